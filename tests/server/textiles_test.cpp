#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "server/textiles/catalogue.h"

namespace weft::testing {
namespace {

using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;
using Row = std::map<std::string, std::string>;

// Fields of a line of CSV, quotes taken off.
std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

// Rows of textiles.csv by id.
const std::map<std::string, Row>& textiles() {
  static const std::map<std::string, Row> result = [] {
    std::ifstream file(WEFT_TEST_DATA_DIR "/textiles.csv");
    std::map<std::string, Row> rows;
    std::string line;
    std::getline(file, line);
    const std::vector<std::string> header = split(line);
    while (std::getline(file, line)) {
      const std::vector<std::string> fields = split(line);
      Row row;
      for (std::size_t i = 0; i < fields.size(); ++i) row[header.at(i)] = fields[i];
      rows[row["id"]] = row;
    }
    return rows;
  }();
  return result;
}

std::string id_of(const v1::TextilePreset& preset) {
  return preset.name().substr(std::string("textiles/").size());
}

// Whether its bending was chosen so that it drapes as published.
bool calibrated(const v1::TextilePreset& preset) { return preset.name().ends_with("_drape"); }

// The row a preset is made from.
const Row& row_of(const v1::TextilePreset& preset) {
  if (calibrated(preset))
    return textiles().at("preset_" + id_of(preset).substr(0, id_of(preset).size() - 6));
  const auto own = textiles().find("preset_" + id_of(preset));
  return own != textiles().end() ? own->second : textiles().at(id_of(preset));
}

// The first of the columns that has a number, times its unit; 0: none has.
double first_of(const Row& row, const std::vector<std::pair<std::string, double>>& columns) {
  for (const auto& [column, unit] : columns) {
    if (!row.at(column).empty()) return std::stod(row.at(column)) * unit;
  }
  return 0;
}

// Load over extension, N/m; 0: no extension given.
double secant_modulus(const Row& row, const std::vector<std::string>& columns) {
  const double load = row.at("extension_load").find("FAST") != std::string::npos ? 98.1 : 490;
  for (const std::string& column : columns) {
    if (!row.at(column).empty()) return load / (std::stod(row.at(column)) / 100);
  }
  return 0;
}

// What a row gives, in SI; 0: nothing.
v1::MeasuredTextile values_of(const Row& row) {
  constexpr double kGramForce = 9.80665e-3;                          // N
  constexpr double kKesBending = kGramForce * (0.01 * 0.01) / 0.01;  // gf cm^2/cm in N m
  v1::MeasuredTextile values;
  values.set_areal_density_kg_per_m2(first_of(row, {{"areal_density_g_m2", 1e-3}}));
  const double k11 = first_of(row, {{"k11_N_per_m", 1}});
  const double k22 = first_of(row, {{"k22_N_per_m", 1}});
  const std::string warp = "E100_or_EMT_warp_pct", weft = "E100_or_EMT_weft_pct";
  values.set_tensile_warp_n_per_m(k11 > 0 ? k11 : secant_modulus(row, {warp}));
  values.set_tensile_weft_n_per_m(k22 > 0 ? k22 : secant_modulus(row, {weft, warp}));
  values.set_shear_n_per_m(first_of(row, {{"G_shear_N_per_m", 1}, {"k33_N_per_m", 1}}));
  values.set_bend_rigidity_warp_n_m(
      first_of(row, {{"B_warp_uNm", 1e-6}, {"B_mean_gfcm2_per_cm", kKesBending}}));
  values.set_bend_rigidity_weft_n_m(
      first_of(row, {{"B_weft_uNm", 1e-6}, {"B_mean_gfcm2_per_cm", kKesBending}}));
  return values;
}

// Values by field name.
std::map<std::string, double> by_name(const v1::MeasuredTextile& values) {
  std::map<std::string, double> result;
  for (int i = 0; i < v1::MeasuredTextile::descriptor()->field_count(); ++i) {
    const auto* field = v1::MeasuredTextile::descriptor()->field(i);
    result[field->name()] = values.GetReflection()->GetDouble(values, field);
  }
  return result;
}

const v1::MeasuredTextile& values(const std::string& name) { return find_preset(name)->values(); }

TEST(Textiles, are_found_by_either_form_of_their_name) {
  ASSERT_NE(find_preset("denim_11oz"), nullptr);
  EXPECT_EQ(find_preset("denim_11oz"), find_preset("textiles/denim_11oz"));
  for (const char* name :
       {"", "textiles/", "denim", "textiles/textiles/denim_11oz", "DENIM_11OZ"}) {
    EXPECT_EQ(find_preset(name), nullptr) << name;
  }
}

TEST(Textiles, come_in_order_of_name_and_once_each) {
  EXPECT_EQ(
      std::ranges::adjacent_find(presets(), std::ranges::greater_equal{}, &v1::TextilePreset::name),
      presets().end());
}

TEST(Textiles, are_the_preset_rows_and_every_row_that_gives_all_values) {
  std::set<std::string> expected, actual;
  for (const auto& [id, row] : textiles()) {
    const std::map<std::string, double> given = by_name(values_of(row));
    const bool complete = std::ranges::all_of(given, [](const auto& value) {
      return value.second > 0 || value.first == "air_drag_kg_per_m2_s";
    });
    if (id.starts_with("preset_")) {
      expected.insert(id.substr(7));
    } else if (complete) {
      expected.insert(id);
    }
  }
  for (const v1::TextilePreset& preset : presets())
    if (!calibrated(preset)) actual.insert(id_of(preset));
  EXPECT_EQ(actual, expected);
  EXPECT_EQ(actual.size(), 18U);
}

TEST(Textiles, have_the_values_that_their_rows_give_and_list_the_missing_ones) {
  for (const v1::TextilePreset& preset : presets()) {
    const std::map<std::string, double> values = by_name(preset.values());
    std::vector<std::string> missing;
    for (const auto& [field, value] : by_name(values_of(row_of(preset)))) {
      if (calibrated(preset) && field.starts_with("bend_rigidity_w")) continue;
      EXPECT_NEAR(values.at(field), value, 5e-5 * value) << preset.name() << ' ' << field;
      if (value == 0 && field != "air_drag_kg_per_m2_s") missing.push_back(field);
    }
    EXPECT_THAT(preset.missing(), ::testing::UnorderedElementsAreArray(missing)) << preset.name();
  }
}

TEST(Textiles, convert_units_as_arithmetic_by_hand_does) {
  // KES: 0.118 gf cm^2/cm x 98.0665 uN m; 490 N/m at 2.29 %
  EXPECT_NEAR(values("cotton_poplin").bend_rigidity_warp_n_m(), 11.572e-6, 1e-9);
  EXPECT_NEAR(values("cotton_poplin").tensile_weft_n_per_m(), 21397, 1);
  EXPECT_NEAR(values("cotton_poplin").areal_density_kg_per_m2(), 0.1503, 1e-12);
  // FAST: 98.1 N/m at 4.6 and 5.87 %; B = 9.81e-6 W C^3 uN m; G = 123 / EB5
  EXPECT_NEAR(values("wool_tropical").tensile_warp_n_per_m(), 2132.6, 0.1);
  EXPECT_NEAR(values("wool_tropical").tensile_weft_n_per_m(), 1671.2, 0.1);
  EXPECT_NEAR(values("wool_tropical").bend_rigidity_warp_n_m() * 1e6, 9.81e-6 * 168 * 3375, 5e-3);
  EXPECT_NEAR(values("wool_tropical").bend_rigidity_weft_n_m() * 1e6, 9.81e-6 * 168 * 3048.6, 5e-3);
  EXPECT_NEAR(values("wool_tropical").shear_n_per_m(), 123 / 4.7, 5e-3);
  // KES: 1.96 gf/(cm deg) = 1.96 x 0.980665 N/m x 180/pi per radian
  EXPECT_NEAR(values("denim_11oz").shear_n_per_m(), 1.96 * 0.980665 * 57.29578, 0.2);
  EXPECT_NEAR(values("denim_11oz").bend_rigidity_warp_n_m(), 17.06e-6, 1e-8);
}

TEST(Textiles, take_bending_and_shear_of_denim_from_the_mean_of_six) {
  const auto mean = [](const std::string& column) {
    double sum = 0;
    for (const char letter : {'A', 'B', 'C', 'D', 'E', 'F'}) {
      sum += std::stod(textiles().at(std::string("kumari_denim_") + letter).at(column));
    }
    return sum / 6;
  };
  EXPECT_NEAR(values("denim_11oz").shear_n_per_m(), mean("G_shear_N_per_m"), 0.5);
  EXPECT_NEAR(values("denim_11oz").bend_rigidity_warp_n_m(),
              98.0665e-6 * mean("B_mean_gfcm2_per_cm"), 5e-8);
}

TEST(Textiles, give_every_property_as_its_row_does) {
  // property and unit to column
  const std::map<std::pair<std::string, std::string>, std::string> columns = {
      {{"areal_density_kg_per_m2", "g/m^2"}, "areal_density_g_m2"},
      {{"tensile_warp_n_per_m", "N/m"}, "k11_N_per_m"},
      {{"tensile_weft_n_per_m", "N/m"}, "k22_N_per_m"},
      {{"tensile_warp_n_per_m", "% at 98.1 N/m"}, "E100_or_EMT_warp_pct"},
      {{"tensile_weft_n_per_m", "% at 98.1 N/m"}, "E100_or_EMT_weft_pct"},
      {{"tensile_warp_n_per_m", "% at 490 N/m"}, "E100_or_EMT_warp_pct"},
      {{"tensile_weft_n_per_m", "% at 490 N/m"}, "E100_or_EMT_warp_pct"},
      {{"extension_emt_pct", "% at 490 N/m"}, "E100_or_EMT_warp_pct"},
      {{"bend_rigidity_warp_n_m", "uN m"}, "B_warp_uNm"},
      {{"bend_rigidity_weft_n_m", "uN m"}, "B_weft_uNm"},
      {{"bend_rigidity_bias_un_m", "uN m"}, "B_bias_uNm"},
      {{"bend_rigidity_warp_n_m", "gf cm^2/cm"}, "B_mean_gfcm2_per_cm"},
      {{"bend_rigidity_weft_n_m", "gf cm^2/cm"}, "B_mean_gfcm2_per_cm"},
      {{"bend_rigidity_kes_mean_gf_cm2_per_cm", "gf cm^2/cm"}, "B_mean_gfcm2_per_cm"},
      {{"bend_hysteresis_2hb_gf_cm_per_cm", "gf cm/cm"}, "twoHB_gfcm_per_cm"},
      {{"shear_kes_gf_per_cm_deg", "gf/(cm deg)"}, "G_kes_gf_per_cm_deg"},
      {{"thickness_mm", "mm"}, "thickness_mm"},
      {{"poisson_ratio", "1"}, "poisson"},
      {{"bending_length_warp_mm", "mm"}, "bending_length_warp_mm"},
      {{"bending_length_weft_mm", "mm"}, "bending_length_weft_mm"},
      {{"drape_coefficient_pct", "%"}, "drape_coefficient_pct"},
  };
  for (const v1::TextilePreset& preset : presets()) {
    const Row& row = row_of(preset);
    for (const v1::TextileProperty& property : preset.properties()) {
      SCOPED_TRACE(preset.name() + ' ' + property.field());
      if (property.status() == "calibrated") {
        EXPECT_TRUE(calibrated(preset));
        const double si = by_name(preset.values()).at(property.field());
        EXPECT_NEAR(std::stod(property.value()) * 1e-6, si, 1e-4 * si);
      } else if (property.field() == "air_drag_kg_per_m2_s") {
        EXPECT_EQ(property.value(), "0");
        EXPECT_EQ(property.status(), "assumed");
      } else if (property.field() == "shear_if_tensor_strain_n_per_m") {
        EXPECT_NEAR(std::stod(property.value()), std::stod(row.at("k33_N_per_m")) / 4, 6e-3);
      } else if (property.field() == "shear_n_per_m") {
        const std::string& g = row.at("G_shear_N_per_m");
        EXPECT_EQ(std::stod(property.value()), std::stod(g.empty() ? row.at("k33_N_per_m") : g));
      } else if (property.value().find('-') != std::string::npos) {
        EXPECT_EQ(property.value(), row.at(columns.at({property.field(), property.unit()})));
      } else {
        const std::string& given = row.at(columns.at({property.field(), property.unit()}));
        EXPECT_EQ(std::stod(property.value()), std::stod(given));
      }
    }
  }
}

TEST(Textiles, give_every_value_a_source_and_a_status) {
  for (const v1::TextilePreset& preset : presets()) {
    SCOPED_TRACE(preset.name());
    for (const std::string* text :
         {&preset.display_name(), &preset.composition(), &preset.status(), &preset.note()}) {
      EXPECT_THAT(*text, Not(IsEmpty()));
    }
    std::multiset<std::string> stated;
    for (const v1::TextileProperty& property : preset.properties()) {
      EXPECT_THAT(property.status(),
                  AnyOf("measured", "derived", "composed", "assumed", "calibrated"));
      EXPECT_THAT(property.unit(), Not(IsEmpty()));
      EXPECT_THAT(property.source(), Not(IsEmpty()));
      stated.insert(property.field());
    }
    for (const auto& [field, value] : by_name(preset.values())) {
      const bool missing = std::ranges::count(preset.missing(), field) > 0;
      EXPECT_EQ(stated.count(field), missing ? 0U : 1U) << field;
    }
  }
}

TEST(Textiles, say_what_silk_faille_and_leather_lack) {
  EXPECT_THAT(find_preset("silk_light")->missing(),
              ElementsAre("tensile_warp_n_per_m", "tensile_weft_n_per_m"));
  EXPECT_THAT(find_preset("polyester_faille")->missing(),
              ElementsAre("tensile_warp_n_per_m", "tensile_weft_n_per_m"));
  EXPECT_EQ(find_preset("leather_garment")->missing_size(), 5);
}

}  // namespace
}  // namespace weft::testing

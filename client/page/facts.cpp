#include "client/page/facts.h"

#include <fmt/format.h>

#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "client/output/text.h"

namespace weft::client {
namespace {

using Rows = std::vector<std::pair<std::string, std::string>>;

std::string value_text(double value, const char* unit) {
  return fmt::format("{} {}", number_text(value), unit);
}

std::string pair_text(double warp, double weft, const char* unit) {
  return fmt::format("{}, {} {}", number_text(warp), number_text(weft), unit);
}

std::string bending_text(const v1::BendingLaw& bending) {
  if (bending.has_isometric()) return "isometric";
  const v1::ChoiKo& law = bending.choi_ko();
  switch (law.evaluator()) {
    case v1::EVALUATOR_SERIES:
      return "series of ten terms";
    case v1::EVALUATOR_EXACT:
      return "exact";
    case v1::EVALUATOR_POLYNOMIAL:
      return fmt::format("polynomial of degree {}", law.degree());
    default:
      return count_of(law.segments(), "line segment") +
             (law.fold_clamp() ? ", clamp folded in" : "") +
             (law.optimal_breakpoints() ? ", optimal breakpoints" : "");
  }
}

// Of a sheet of triangles.
Rows shape_rows(const v1::SheetLayout& layout, const ClothMesh& mesh) {
  double area = 0;
  Rows panels;
  for (const ClothPanel& panel : mesh.panels) {
    const double part = area_of(mesh, panel);
    area += part;
    std::string text = value_text(part, "m²");
    if (panel.grain_rad != 0)
      text += fmt::format(", grain {}°", number_text(panel.grain_rad * 180 / std::numbers::pi));
    if (panel.own_textile) text += ", textile of its own";
    if (!panel.preset.empty()) text += ", textile " + panel.preset;
    panels.emplace_back("panel " + panel.name, std::move(text));
  }
  Rows rows{{"particles", std::to_string(layout.particle_count())},
            {"triangles", std::to_string(mesh.triangles.size())},
            {"median edge", value_text(1e3 * mesh.spacing_m, "mm")},
            {"area", value_text(area, "m²")},
            {"panels", std::to_string(mesh.panels.size())}};
  if (panels.size() > 1) rows.insert(rows.end(), panels.begin(), panels.end());
  return rows;
}

Rows shape_rows(const v1::Grid& grid) {
  Rows rows{{"particles", fmt::format("{} x {}", grid.rows(), grid.columns())},
            {"spacing", value_text(1e3 * grid.spacing_m(), "mm")}};
  if (grid.simulated_every() > 1)
    rows.emplace_back("simulated", fmt::format("each {}. row and column, the others interpolated",
                                               grid.simulated_every()));
  return rows;
}

Rows textile_rows(const v1::Textile& textile) {
  Rows rows;
  if (textile.has_measured()) {
    const v1::MeasuredTextile& values = textile.measured();
    rows.emplace_back("areal density", value_text(values.areal_density_kg_per_m2(), "kg/m²"));
    rows.emplace_back("tensile, warp, weft", pair_text(values.tensile_warp_n_per_m(),
                                                       values.tensile_weft_n_per_m(), "N/m"));
    rows.emplace_back("shear", value_text(values.shear_n_per_m(), "N/m"));
    rows.emplace_back("bending, warp, weft",
                      pair_text(1e6 * values.bend_rigidity_warp_n_m(),
                                1e6 * values.bend_rigidity_weft_n_m(), "µN m"));
    rows.emplace_back("air drag", value_text(values.air_drag_kg_per_m2_s(), "kg/(m² s)"));
  } else {
    const v1::RawTextile& values = textile.raw();
    rows.emplace_back("mass of a particle", value_text(1e3 * values.particle_mass_kg(), "g"));
    rows.emplace_back("k_s, stretch", value_text(values.stretch_n_per_m(), "N/m"));
    rows.emplace_back("k_s, shear", value_text(values.shear_n_per_m(), "N/m"));
    rows.emplace_back("k_b, bend", value_text(values.bend_n_m2(), "N m²"));
    rows.emplace_back("c_b, clamp", value_text(values.clamp_n_per_m(), "N/m"));
    rows.emplace_back("air drag", value_text(values.air_drag_kg_per_s(), "kg/s"));
  }
  if (textile.has_damping_ratio())
    rows.emplace_back("damping", value_text(textile.damping_ratio(), "of critical"));
  else if (textile.has_damping_kg_per_s())
    rows.emplace_back("damping", value_text(textile.damping_kg_per_s(), "kg/s"));
  else
    rows.emplace_back("damping", "default");
  rows.emplace_back("friction", number_text(textile.friction_coefficient()));
  return rows;
}

Rows sheet_rows(const v1::SheetLayout& layout, const v1::Sheet& sheet, const ClothMesh& mesh) {
  Rows rows = is_grid(layout) ? shape_rows(sheet.grid()) : shape_rows(layout, mesh);
  const Rows textile = textile_rows(sheet.textile());
  rows.insert(rows.end(), textile.begin(), textile.end());
  for (const ClothPanel& panel : mesh.panels) {
    if (!panel.own_textile) continue;
    for (const auto& [label, text] : textile_rows(panel.textile))
      rows.emplace_back(fmt::format("{} of {}", label, panel.name), text);
  }
  rows.emplace_back("bending law", bending_text(sheet.bending()));
  return rows;
}

// "2026-11-21 06:52 UTC" of "2026-11-21T06:52:11Z"
std::string minute_text(const std::string& time) {
  if (time.size() < 16) return time;
  return time.substr(0, 10) + ' ' + time.substr(11, 5) + " UTC";
}

Rows run_rows(const RecordingReader& recording, const Tally& tally) {
  const v1::FrameStats& end = tally.last_stats;
  Rows rows{{"recorded", minute_text(recording.recorded_at())},
            {"numerics", recording.header().numerics_id()},
            {"frames", std::to_string(tally.frames)},
            {"frame step", seconds_text(recording.header().frame_step_s())},
            {"simulated until", fmt::format("{:.6g} s", tally.last_time_s)}};
  if (!recording.header().format().stats()) return rows;
  rows.emplace_back("substeps", std::to_string(tally.substeps));
  rows.emplace_back("substep at the end", seconds_text(end.substep_s()));
  rows.emplace_back("largest strain", percent_text(tally.largest_strain));
  if (tally.most_cuts)
    rows.emplace_back(
        "cuts of cloth",
        *tally.most_cuts == 0 ? "none" : fmt::format("{} in a frame at most", *tally.most_cuts));
  rows.emplace_back("repairs", tally.repairs == 0 ? "none" : std::to_string(tally.repairs));
  rows.emplace_back("at rest at the end", (end.at_rest() ? "yes" : "no") + residual_text(end));
  return rows;
}

Rows world_rows(const v1::Scene& scene) {
  const v1::Vector3& gravity = scene.environment().gravity_m_per_s2();
  const v1::Vector3& wind = scene.environment().wind().velocity_m_per_s();
  const auto vector = [](const v1::Vector3& value, const char* unit) {
    return fmt::format("({:.4g}, {:.4g}, {:.4g}) {}", value.x(), value.y(), value.z(), unit);
  };
  Rows rows{{"gravity", vector(gravity, "m/s²")}};
  if (scene.environment().has_wind()) rows.emplace_back("wind", vector(wind, "m/s"));
  for (const auto& collider : scene.colliders()) {
    rows.emplace_back("friction of " + collider.name(),
                      number_text(collider.friction_coefficient()));
  }
  return rows;
}

}  // namespace

Json page_facts(const RecordingReader& recording, const std::vector<ClothMesh>& cloth,
                const Tally& tally) {
  Json facts = Json::array();
  facts.push_back({{"group", "Recording"}, {"rows", run_rows(recording, tally)}});
  for (int i = 0; i < recording.scene().sheets_size(); ++i) {
    const v1::Sheet& sheet = recording.scene().sheets(i);
    facts.push_back({{"group", fmt::format("Textile of {} at the start", sheet.name())},
                     {"rows", sheet_rows(recording.header().sheets(i), sheet,
                                         cloth[static_cast<std::size_t>(i)])}});
  }
  facts.push_back({{"group", "Surroundings"}, {"rows", world_rows(recording.scene())}});
  return facts;
}

}  // namespace weft::client

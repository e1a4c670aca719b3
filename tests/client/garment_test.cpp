#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "client/figures/dress_forms.h"
#include "client/figures/mesh_file.h"
#include "client/garments/garment_templates.h"
#include "client/garments/pattern_file.h"
#include "client/imports/import.h"
#include "client/json_file.h"
#include "client/scene_file.h"
#include "tests/client/client_test.h"
#include "tests/client/mesh_files.h"

namespace weft::testing {
namespace {

using client::Problem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;
using Json = nlohmann::ordered_json;

// A front and a back of a skirt, the back drawn clockwise as it looks the other way, in cm.
Json two_panels() {
  return Json::parse(read_file(WEFT_TEST_DATA_DIR "/garments/skirt_specification.json"));
}

client::ImportedPattern imported(const Json& json) {
  return client::read_garment_code("it.json", json);
}

std::string fault(const Json& json) {
  try {
    imported(json);
  } catch (const Problem& problem) {
    return problem.what();
  }
  return "none";
}

std::vector<double> points(const v1::PatternEdge& edge) {
  return {edge.points_m().begin(), edge.points_m().end()};
}

TEST(GarmentCode, PanelsAreInMetresWithTheirPlacesAndCurves) {
  const auto read = imported(two_panels());
  ASSERT_EQ(read.pattern.panels_size(), 2);
  const v1::PatternPanel& front = read.pattern.panels(0);
  EXPECT_EQ(front.name(), "front");
  EXPECT_THAT(points(front.edges(0)), ElementsAre(0.3, 0));
  // a tenth of the chord to the left of an edge that runs to -u
  EXPECT_THAT(points(front.edges(2)), ElementsAre(0, 0.46, -0.2, 0.5));
  EXPECT_EQ(front.edges(2).label(), "waist");
  EXPECT_EQ(front.placement().origin_m().y(), 0.9);
  ASSERT_EQ(read.pattern.seams_size(), 2);
  EXPECT_EQ(read.pattern.seams(1).second_side(0).panel(), "back");
  EXPECT_EQ(read.pattern.seams(1).second_side(0).edge(), 0);
}

TEST(GarmentCode, PanelsDrawnFromTheBackAreMirroredAndStayWhereTheyAre) {
  const auto read = imported(two_panels());
  EXPECT_THAT(read.notes, ElementsAre(HasSubstr("1 panel is drawn from the back")));
  const v1::PatternPanel& back = read.pattern.panels(1);
  EXPECT_THAT(points(back.edges(0)), ElementsAre(0.2, 0.5));
  EXPECT_THAT(points(back.edges(1)), ElementsAre(0, 0.46, -0.2, 0.5));
  // turned about v by half a turn: u looks to -x
  const v1::Rotation& turn = back.placement().rotation();
  EXPECT_NEAR(turn.w(), 0, 1e-9);
  EXPECT_NEAR(std::abs(turn.y()), 1, 1e-9);
}

TEST(GarmentCode, ArcsPassThroughTheirMiddle) {
  struct Arc {
    double radius;  // cm
    int large, right;
    double middle;  // v, m: R - sqrt(R^2 - 30^2) from the chord of 60 cm, or with the plus
  };
  for (const Arc& arc : {Arc{30, 0, 0, 0.3}, Arc{30, 0, 1, -0.3}, Arc{50, 0, 0, 0.1},
                         Arc{50, 0, 1, -0.1}, Arc{50, 1, 1, -0.9}}) {
    Json json = two_panels();
    json["pattern"]["panels"]["Front"]["edges"][0]["curvature"] = {
        {"type", "circle"}, {"params", {arc.radius, arc.large, arc.right}}};
    const v1::PatternEdge edge = imported(json).pattern.panels(0).edges(0);
    EXPECT_TRUE(edge.arc());
    EXPECT_THAT(points(edge), ElementsAre(0, arc.middle, 0.3, 0));
  }
}

TEST(GarmentCode, TheOlderListOfCurvatureAbsoluteOnesAndCentredPanelsAreRead) {
  Json json = two_panels();
  auto& edge = json["pattern"]["panels"]["Front"]["edges"][2];
  edge["curvature"] = {0.5, 0.1};
  EXPECT_THAT(points(imported(json).pattern.panels(0).edges(2)), ElementsAre(0, 0.46, -0.2, 0.5));
  edge["curvature"] = {0, 46};
  json["pattern"]["panels"]["back"]["edges"][1].erase("curvature");
  json["properties"]["curvature_coords"] = "absolute";
  EXPECT_THAT(points(imported(json).pattern.panels(0).edges(2)), ElementsAre(0, 0.46, -0.2, 0.5));
  json["properties"]["normalize_panel_translation"] = true;
  const auto front = imported(json).pattern.panels(0);
  EXPECT_THAT(points(front.edges(0)), ElementsAre(0.3, -0.25));
  EXPECT_EQ(front.placement().origin_m().y(), 1.15);
  json["properties"].erase("units_in_meter");
  EXPECT_THAT(imported(json).notes[0], HasSubstr("taken as cm"));
}

TEST(GarmentCode, RotationsAreAboutXThenYThenZ) {
  Json json = two_panels();
  json["pattern"]["panels"]["Front"]["rotation"] = {90, 90, 0};
  const v1::Rotation turn = imported(json).pattern.panels(0).placement().rotation();
  const Eigen::Quaterniond rotation(turn.w(), turn.x(), turn.y(), turn.z());
  // v goes to z about x, and from there to x about y
  EXPECT_LT((rotation * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitX()).norm(), 1e-6);
}

TEST(GarmentCode, RightSidesSewnToWrongOnesRunInTheSameDirection) {
  Json json = two_panels();
  json["pattern"]["stitches"][0].push_back("right_wrong");
  EXPECT_TRUE(imported(json).pattern.seams(0).same_direction());
  EXPECT_FALSE(imported(json).pattern.seams(1).same_direction());
}

TEST(GarmentCode, WhatItHoldsUpIsAWaist) {
  Json json = two_panels();
  json["pattern"]["panels"]["Front"]["edges"][2]["label"] = "lower_interface";
  json["pattern"]["panels"]["Front"]["edges"][0]["label"] = "Left Collar";
  const v1::PatternPanel front = imported(json).pattern.panels(0);
  EXPECT_EQ(front.edges(2).label(), "waist");
  EXPECT_EQ(front.edges(0).label(), "left_collar");
}

TEST(GarmentCode, FaultsAreToldWithFilePanelAndEdge) {
  const auto with = [](const std::function<void(Json&)>& change) {
    Json json = two_panels();
    change(json);
    return fault(json);
  };
  const auto of_front = [&](const std::function<void(Json&)>& change) {
    return with([&](Json& json) { change(json["pattern"]["panels"]["Front"]); });
  };
  EXPECT_THAT(of_front([](Json& panel) {
                panel["edges"][1]["endpoints"] = {0, 2};
              }),
              AllOf(HasSubstr("it.json"), HasSubstr("panel front, edge 1 begins at vertex 0, where "
                                                    "edge 0 ends at vertex 1")));
  EXPECT_THAT(of_front([](Json& panel) {
                panel["edges"][1]["endpoints"] = {1, 7};
              }),
              HasSubstr("panel front, edge 1, endpoint 1 is 7, not one of 0 to 3"));
  EXPECT_THAT(of_front([](Json& panel) { panel["edges"][2]["curvature"]["type"] = "spline"; }),
              HasSubstr("panel front, edge 2 has a curvature of type \"spline\""));
  EXPECT_THAT(of_front([](Json& panel) {
                panel["edges"][0]["curvature"] = {{"type", "circle"}, {"params", {20, 0, 0}}};
              }),
              HasSubstr("a radius of 0.2 m between ends 0.6 m apart"));
  EXPECT_THAT(of_front([](Json& panel) {
                panel["vertices"][2] = {1, "x"};
              }),
              HasSubstr("panel front, vertex 2 is \"x\", not a finite number"));
  EXPECT_THAT(of_front([](Json& panel) { panel.erase("edges"); }),
              HasSubstr("panel front has no \"edges\""));
  EXPECT_THAT(with([](Json& json) { json["pattern"]["stitches"][1][0]["panel"] = "side"; }),
              HasSubstr("stitch 1 names a panel \"side\" that is none"));
  EXPECT_THAT(with([](Json& json) { json["pattern"]["stitches"][1][1]["edge"] = -1; }),
              HasSubstr("stitch 1, edge of panel back is -1, not one of 0 to 3"));
  EXPECT_THAT(with([](Json& json) { json["properties"]["units_in_meter"] = 0; }),
              HasSubstr("properties.units_in_meter 0 is not within 0.001 to 1e6"));
}

// Two squares of 5 x 5 points beside each other, one 0.2 m in front, with what follows.
std::string stage(const std::string& stitches, bool uv = false) {
  return lattice_obj({.spacing = 0.1, .uv = uv}) +
         lattice_obj({.spacing = 0.1, .z = 0.2, .uv = uv, .first = 25}) + stitches;
}

TEST(StageObj, StitchedPointsAreOneInTheMeanOfTheirPlaces) {
  std::string stitches = "seam 5\n";
  // the left column of one to that of the other
  for (int row = 0; row < 5; ++row)
    stitches += "stitch " + std::to_string(5 * row) + ' ' + std::to_string(25 + 5 * row) + ' ' +
                std::to_string(26 + 5 * row) + " 0\n";
  client::ImportOptions mended;
  mended.mend = true;
  const client::Import import = client::import_mesh("stage.obj", stage(stitches), mended);
  EXPECT_EQ(import.mesh.positions.size(), 45);
  EXPECT_EQ(import.mesh.panels.size(), 2);
  EXPECT_THAT(import.mesh.notes, ::testing::Contains(HasSubstr("5 stitches sewn")));
  int at_seam = 0;
  for (const auto& place : import.mesh.positions) at_seam += std::abs(place.z() - 0.1) < 1e-12;
  EXPECT_EQ(at_seam, 5);
  // the flat shape is that of the squares before
  double area = 0;
  for (std::size_t t = 0; t < import.mesh.triangles.size(); ++t) {
    const auto corners = client::flat_corners(import.mesh, t);
    area += client::signed_area(corners);
  }
  EXPECT_NEAR(area, 2 * 0.16, 1e-9);
}

TEST(StageObj, FaultsOfStitchesAreToldWithTheirLine) {
  for (const char* wrong : {"stitch 3 99 4 0\n", "stitch 3 4\n", "stitch 1 2 3 1.5\n"}) {
    try {
      client::import_mesh("stage.obj", stage(wrong), {});
      ADD_FAILURE() << wrong;
    } catch (const Problem& problem) {
      EXPECT_THAT(problem.what(), AllOf(HasSubstr("stage.obj"), HasSubstr("line "),
                                        HasSubstr("three points of 0 to 49")));
    }
  }
}

class Garment : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return directory_.path(name); }

  const TemporaryDirectory directory_;
};

TEST_F(Garment, OfGarmentCodeIsImportedAndBuilt) {
  write_file(path("skirt_specification.json"), two_panels().dump());
  const Outcome done =
      run_weft({"garment", "import", path("skirt_specification.json"), "-o", path("skirt.json")});
  ASSERT_EQ(done.exit, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("2 panels, 2 seams"));
  const Outcome built = run_weft({"--json", "garment", "build", path("skirt.json"), "--edge",
                                  "0.03", "-o", path("scene.json")});
  ASSERT_EQ(built.exit, 0) << built.err;
  EXPECT_FALSE(built.json().contains("notes"));
  EXPECT_EQ(built.json()["edges"].size(), 8);
  // a file of GarmentCode can be built at once, to the same scene
  ASSERT_EQ(run_weft({"garment", "build", path("skirt_specification.json"), "--edge", "0.03", "-o",
                      path("again.json")})
                .exit,
            0);
  const v1::Scene one = client::read_scene(path("scene.json")),
                  other = client::read_scene(path("again.json"));
  EXPECT_EQ(one.sheets(0).triangles().SerializeAsString(),
            other.sheets(0).triangles().SerializeAsString());
  EXPECT_EQ(run_weft({"scene", "check", path("scene.json")}).exit, 0);
}

TEST_F(Garment, WhatCannotBeSewnIsToldByItsPlaceInTheFile) {
  Json json = two_panels();
  json["pattern"]["stitches"].push_back(json["pattern"]["stitches"][0]);
  write_file(path("twice.json"), json.dump());
  const Outcome refused = run_weft({"garment", "build", path("twice.json")});
  EXPECT_EQ(refused.exit, 1);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("  seams[2].first_side[0]   panel front, edge 1"),
                                 HasSubstr("is sewn twice: seam 0 has it")));
  EXPECT_THAT(refused.err, Not(HasSubstr("pattern.")));
}

TEST_F(Garment, WithoutAWaistItsHighestBorderIsHeldUnlessItHasShoulders) {
  const auto held = [&](const Json& pattern) {
    write_file(path("it.json"), pattern.dump());
    const Outcome built = run_weft({"--json", "garment", "build", path("it.json"), "--edge", "0.03",
                                    "-o", path("scene.json"), "--force"});
    EXPECT_EQ(built.exit, 0) << built.err;
    const v1::Scene scene = client::read_scene(path("scene.json"));
    std::set<int> all, waist;
    for (const v1::Hold& hold : scene.dressing().holds())
      all.insert(hold.particles().begin(), hold.particles().end());
    const nlohmann::json edges = built.json()["edges"];
    for (const auto& edge : edges)
      if (edge.value("edge", 0) == (edge["panel"] == "front" ? 2 : 1))
        for (const int i : edge["particles"]) waist.insert(i);
    return std::pair(all, waist);
  };
  Json json = two_panels();
  json["pattern"]["panels"]["Front"]["edges"][2].erase("label");
  const auto [all, waist] = held(json);
  EXPECT_EQ(all, waist);
  EXPECT_THAT(
      held(Json::parse(client::pattern_text(client::make_garment("tshirt", client::Measures{}))))
          .first,
      ::testing::IsEmpty());
}

TEST_F(Garment, TemplatesAreListedAndNamed) {
  const Outcome help = run_weft({"garment", "new", "--help"});
  for (const auto& info : client::garment_templates()) EXPECT_THAT(help.out, HasSubstr(info.name));
  EXPECT_THAT(run_weft({"garment", "new", "toga"}).err, HasSubstr("there is no garment \"toga\""));
  EXPECT_THAT(run_weft({"garment", "new", "skirt", "--size", "41"}).err,
              HasSubstr("--size: 41 is not even and within 32 to 54"));
}

double girth_of(const nlohmann::json& built, const std::string& label) {
  double sum = 0;
  for (const auto& edge : built["edges"])
    if (edge["label"] == label) sum += edge["length_m"].get<double>();
  return sum;
}

TEST(DressForms, AreMadeOnceForEachPerson) {
  client::DressForms forms;
  const auto forty = client::measures_of_size(client::FigureKind::kFemale, 40);
  const auto first = forms.of(forty);
  EXPECT_EQ(forms.of(forty), first);
  EXPECT_EQ(first->mesh.vertices, client::make_dress_form(forty).mesh.vertices);
  auto tall = forty;
  tall.stature = 1.85;
  EXPECT_NE(forms.of(tall), first);
}

// Every garment, by figure and size.
class GarmentTemplates : public Garment,
                         public ::testing::WithParamInterface<std::pair<client::FigureKind, int>> {
};

TEST_P(GarmentTemplates, StartOutsideTheBodyUntangledAndSymmetric) {
  const auto& [figure, size] = GetParam();
  const client::DressForm form = client::make_dress_form(client::measures_of_size(figure, size));
  const std::string body = path("body.obj"), pattern = path("pattern.json"),
                    scene = path("scene.json");
  write_file(body, client::obj_of(form.mesh));
  for (const auto& info : client::garment_templates()) {
    SCOPED_TRACE(info.name);
    write_file(pattern, client::pattern_text(client::make_garment(info.name, form)));
    const Outcome built =
        run_weft({"--json", "garment", "build", pattern, "--edge", "0.02", "--body", body,
                  "--textile", info.textile, "-o", scene, "--force"});
    ASSERT_EQ(built.exit, 0) << built.err;
    EXPECT_GT(built.json()["least_height"].get<double>(), 0.35);
    const Outcome checked = run_weft({"scene", "check", scene});
    ASSERT_EQ(checked.exit, 0) << checked.err;
    EXPECT_THAT(checked.out, AllOf(Not(HasSubstr("STARTS_INSIDE")), Not(HasSubstr("TANGLED"))));

    // each particle has its mirror image
    const std::string bytes = client::read_scene(scene).sheets(0).triangles().data().positions_m();
    const std::size_t count = bytes.size() / 12;
    std::vector<float> at(3 * count);
    std::memcpy(at.data(), bytes.data(), bytes.size());
    std::set<std::tuple<long, long, long>> places;
    const auto place = [&](std::size_t i, double side, long shift) {
      const auto rounded = [](double value) { return std::lround(value * 1e4); };
      return std::tuple(rounded(side * double{at[i]}) + shift, rounded(double{at[count + i]}),
                        rounded(double{at[2 * count + i]}));
    };
    for (std::size_t i = 0; i < count; ++i)
      for (const long shift : {-1, 0, 1}) places.insert(place(i, 1, shift));
    std::size_t alone = 0;
    for (std::size_t i = 0; i < count; ++i) alone += places.contains(place(i, -1, 0)) ? 0 : 1;
    EXPECT_LT(static_cast<double>(alone), 0.02 * static_cast<double>(count));
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, GarmentTemplates,
                         ::testing::Values(std::pair(client::FigureKind::kFemale, 36),
                                           std::pair(client::FigureKind::kFemale, 48),
                                           std::pair(client::FigureKind::kMale, 50)),
                         [](const auto& sized) {
                           const bool female = sized.param.first == client::FigureKind::kFemale;
                           return (female ? "Woman" : "Man") + std::to_string(sized.param.second);
                         });

TEST_F(Garment, AWaistbandFollowsTheWaistAskedFor) {
  for (const auto& [garment, waist] :
       {std::pair("skirt", 0.66), std::pair("skirt", 0.8), std::pair("trousers", 0.72)}) {
    const std::string pattern = path(garment + std::to_string(waist) + ".json");
    ASSERT_EQ(run_weft({"garment", "new", garment, "--waist", std::to_string(waist), "--hip",
                        std::to_string(waist + 0.24), "-o", pattern})
                  .exit,
              0);
    const Outcome built = run_weft({"--json", "garment", "build", pattern, "--edge", "0.02"});
    ASSERT_EQ(built.exit, 0) << built.err;
    EXPECT_NEAR(girth_of(built.json(), "upper"), waist, 0.025);
  }
}

}  // namespace
}  // namespace weft::testing

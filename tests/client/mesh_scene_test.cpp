#include <gmock/gmock.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "client/imports/import.h"
#include "client/imports/mesh_facts.h"
#include "client/scene_file.h"
#include "tests/client/client_test.h"
#include "tests/client/mesh_files.h"
#include "tests/client/t_shirt.h"

namespace weft::testing {
namespace {

using client::facts_of;
using client::Import;
using client::import_mesh;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

class MeshScene : public ::testing::Test {
 protected:
  // weft scene new --mesh of that file, into scene.json
  Outcome make(const std::string& name, const std::string& bytes,
               std::vector<std::string> options = {}) {
    write_file(directory_.path(name), bytes);
    std::vector<std::string> words{
        "scene",  "new", "--mesh", directory_.path(name), "-o", directory_.path("scene.json"),
        "--force"};
    words.insert(words.end(), options.begin(), options.end());
    return run_weft(words);
  }
  v1::Sheet sheet() const { return client::read_scene(directory_.path("scene.json")).sheets(0); }

  TemporaryDirectory directory_;
};

TEST(GltfImport, HasAPanelForEachPrimitiveAndNoSplitPoints) {
  const Import import = import_mesh("square.glb", square_glb(), {});
  EXPECT_THAT(import.mesh.panels, ElementsAre("body", "belt"));
  EXPECT_THAT(import.mesh.positions, SizeIs(6)) << "two points are those of both primitives";
  EXPECT_EQ(facts_of(import).pieces, 1);
  EXPECT_THAT(facts_of(import).seams, SizeIs(0)) << "UV go on";
  EXPECT_EQ(import.flat_scale, 1);
  EXPECT_EQ(import.mesh.positions[0].y(), 1) << "as its node puts it";
  EXPECT_GT(client::signed_area(client::flat_corners(import.mesh, 0)), 0) << "v is up, as in OBJ";
  EXPECT_EQ(place(import.mesh, 3), "square, primitive 1, triangle 2");
}

TEST(GltfImport, RefusesWhatReachesBeyondItsBuffer) {
  std::string bytes = square_glb();
  bytes.replace(bytes.find("\"count\": 4"), 10, "\"count\": 9");
  bytes.replace(bytes.find("\"byteOffset\": 160, \"byteLength\": 12"), 35,
                "\"byteOffset\": 164, \"byteLength\": 12");
  try {
    import_mesh("square.glb", bytes, {});
    FAIL() << "it was taken";
  } catch (const client::Problem& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("square"));
  }
}

TEST_F(MeshScene, OfAnObjFileIsReadBackAsItWasMade) {
  const Outcome made = make("Best Shirt.obj", lattice_obj({.panels = true}),
                            {"--pin", "border:top", "--pin", "0,1", "--textile", "denim_11oz",
                             "--panel-textile", "right=jersey_interlock", "--grain", "90", "--set",
                             "sheets[0].skin_m=0.004", "--accuracy", "draft"});
  ASSERT_EQ(made.exit, 0) << made.err;
  const v1::Sheet sheet = this->sheet();
  EXPECT_EQ(sheet.name(), "best_shirt");
  EXPECT_EQ(sheet.textile().preset(), "denim_11oz");
  EXPECT_EQ(sheet.skin_m(), 0.004);
  const v1::MeshData& mesh = sheet.triangles().data();
  EXPECT_THAT(mesh.positions_m(), SizeIs(25 * 12));
  EXPECT_THAT(mesh.triangles(), SizeIs(32 * 12));
  ASSERT_EQ(mesh.panels_size(), 2);
  EXPECT_FALSE(mesh.panels(0).has_textile());
  EXPECT_EQ(mesh.panels(1).textile().preset(), "jersey_interlock");
  EXPECT_NEAR(mesh.panels(1).grain_rad(), 1.5708, 1e-4);
  ASSERT_EQ(sheet.pins_size(), 2);
  EXPECT_THAT(sheet.pins(0).particles(), ElementsAre(20, 21, 22, 23, 24));
  EXPECT_THAT(sheet.pins(1).particles(), ElementsAre(0, 1));
}

TEST_F(MeshScene, SaysWhatWasFound) {
  const Outcome made = make("shirt.obj", lattice_obj({.panels = true}), {"--pin", "border:top"});
  EXPECT_THAT(made.out, AllOf(HasSubstr("25 particles, 32 triangles, 1 piece of 4 x 4 x 0 m"),
                              HasSubstr("2, by g"), HasSubstr("left: 16 triangles, 8 m^2, 2 x 4 m"),
                              HasSubstr("border:1: 16 m, 16 particles"),
                              HasSubstr("border:top 4 m"), HasSubstr("1 m for a unit of UV")));
  EXPECT_THAT(made.out, HasSubstr("border:top: 5 particles"));
  const auto json = make("shirt.obj", lattice_obj({.panels = true}), {"--json"}).json();
  EXPECT_EQ(json["mesh"]["particles"], 25);
  EXPECT_EQ(json["mesh"]["panels"][1]["name"], "right");
  EXPECT_EQ(json["mesh"]["flat_scale_m"], 1);
}

TEST_F(MeshScene, OnItsWayToAnotherProgramHasItsFactsBeside) {
  write_file(directory_.path("a.obj"), lattice_obj({}));
  const Outcome made = run_weft({"scene", "new", "--mesh", directory_.path("a.obj")});
  EXPECT_TRUE(made.json().contains("sheets"));
  EXPECT_THAT(made.err, HasSubstr("25 particles"));
}

TEST_F(MeshScene, RefusesWhatDoesNotFit) {
  const auto refused = [&](const std::vector<std::string>& options) {
    const Outcome made = make("a.obj", lattice_obj({}), options);
    EXPECT_EQ(made.exit, 2) << made.out;
    return made.err;
  };
  EXPECT_THAT(refused({"--template", "hang"}), HasSubstr("--mesh"));
  EXPECT_THAT(refused({"--rows", "5"}), HasSubstr("--rows"));
  EXPECT_THAT(refused({"--panel-textile", "belt=denim_11oz"}),
              HasSubstr("no panel \"belt\"; it has panel"));
  EXPECT_THAT(refused({"--pin", "collar"}), HasSubstr("border:top"));
  EXPECT_THAT(run_weft({"scene", "new"}).err, AllOf(HasSubstr("--template"), HasSubstr("--mesh")));
  EXPECT_THAT(run_weft({"scene", "new", "-t", "hang", "--mend"}).err, HasSubstr("--mesh"));
}

TEST_F(MeshScene, OfFaultyFilesNamesEveryPlace) {
  const Outcome made = make("a.obj", "v 0 0 0\nv nan 0 0\nf 1 2 7\n");
  EXPECT_EQ(made.exit, 4);
  EXPECT_THAT(made.err,
              AllOf(HasSubstr("a.obj"), HasSubstr("line 2"), HasSubstr("line 3 (face 1)")));
}

TEST_F(MeshScene, HasBodiesFromFilesInTheUnitAskedFor) {
  write_file(directory_.path("block.obj"),
             "v -5 -5 -5\nv 5 -5 -5\nv -5 5 -5\nv 5 5 -5\n"
             "v -5 -5 5\nv 5 -5 5\nv -5 5 5\nv 5 5 5\n"
             "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n");
  const std::string file = directory_.path("scene.json");
  const Outcome made = run_weft({"scene", "new", "--template", "hang", "--body",
                                 directory_.path("block.obj"), "--unit", "cm", "-o", file});
  ASSERT_EQ(made.exit, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("block: 12 triangles"));
  const v1::Scene scene = client::read_scene(file);
  ASSERT_GE(scene.colliders_size(), 1);
  const v1::Collider& body = *scene.colliders().rbegin();
  EXPECT_EQ(body.name(), "block");
  float first = 0;
  std::memcpy(&first, body.mesh().data().positions_m().data(), sizeof first);
  EXPECT_FLOAT_EQ(first, -0.05F);
  EXPECT_EQ(run_weft({"scene", "check", file}).exit, 0);
}

TEST_F(MeshScene, IsWornByADressFormOfTheGirthsAskedFor) {
  const std::string body = directory_.path("body.glb"), file = directory_.path("scene.json");
  const Outcome made = run_weft({"--json", "body", "new", "--figure", "female", "--stature", "1.72",
                                 "--bust", "0.96", "--waist", "0.8", "--hip", "1.04", "-o", body});
  ASSERT_EQ(made.exit, 0) << made.err;
  const auto answer = nlohmann::json::parse(made.out);
  EXPECT_NEAR(answer["stature_m"], 1.72, 1e-9);
  for (const auto& girth : answer["girths"])
    EXPECT_NEAR(girth["found_m"], girth["wanted_m"], 5e-3) << girth["name"];
  ASSERT_EQ(run_weft({"scene", "new", "--template", "hang", "--body", body, "-o", file}).exit, 0);
  const Outcome checked = run_weft({"scene", "check", file});
  EXPECT_EQ(checked.exit, 0) << checked.err;
  EXPECT_THAT(checked.out, Not(HasSubstr("BODY_")));
}

TEST_F(MeshScene, IsWhatACheckOfAMeshLeadsTo) {
  write_file(directory_.path("shirt.obj"), lattice_obj({}));
  EXPECT_THAT(run_weft({"scene", "check", directory_.path("shirt.obj")}).err,
              AllOf(HasSubstr("is a mesh, not a scene file"), HasSubstr("weft scene new --mesh")));
  write_file(directory_.path("shirt.fbx"), "");
  EXPECT_THAT(run_weft({"scene", "check", directory_.path("shirt.fbx")}).err,
              HasSubstr("export it as .obj or .glb"));
}

TEST(TShirtMesh, HasTwoPanelsFourOpeningsAndItsSeams) {
  const Import import = import_mesh("shirt.obj", t_shirt_obj({.uv_unit = 1.2}), {});
  const client::MeshFacts facts = facts_of(import);
  EXPECT_NEAR(facts.particles, 3500, 150);
  EXPECT_EQ(facts.pieces, 1);
  EXPECT_NEAR(import.flat_scale, 1.2, 0.012);
  ASSERT_THAT(facts.panels, SizeIs(2));
  EXPECT_EQ(facts.panels[0].name, "front");
  std::vector<std::string> openings;
  for (const auto& border : facts.borders) openings.push_back(border.name);
  EXPECT_THAT(openings, ::testing::UnorderedElementsAre("top", "bottom", "left", "right"));
  ASSERT_THAT(facts.seams, SizeIs(1));
  // both sides, both under arms, both shoulders with their sleeves, somewhat sloped
  EXPECT_NEAR(facts.seams[0].length, 2 * (0.48 + 0.16 + 0.33), 0.1);
  EXPECT_LT(facts.lowest[0].cost, 1.5);
}

TEST_F(MeshScene, OfATShirtIsCheckedAndRecorded) {
  const Outcome made = make("shirt.obj", t_shirt_obj({.spacing = 0.031}), {"--pin", "border:top"});
  ASSERT_EQ(made.exit, 0) << made.err;
  const std::string scene = directory_.path("scene.json"), file = directory_.path("shirt.weft");
  const Outcome checked = run_weft({"scene", "check", scene});
  EXPECT_EQ(checked.exit, 0) << checked.err;
  EXPECT_THAT(
      checked.out,
      HasSubstr("1 sheet, " + std::to_string(sheet().triangles().data().positions_m().size() / 12) +
                " particles"));
  const Outcome recorded =
      run_weft({"record", scene, "--embedded", "--to", "5", "--json", "-o", file});
  ASSERT_EQ(recorded.exit, 0) << recorded.err;
  EXPECT_EQ(recorded.json()["frames"], 6);
  EXPECT_LT(recorded.json()["largest_strain"], 0.2);
}

}  // namespace
}  // namespace weft::testing

#include "core/verdict.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/support/core/scenes.h"
#include "tests/support/core/sewn_tube.h"

namespace weft::testing {
namespace {

std::vector<std::string> codes(const Simulation& simulation) {
  std::vector<std::string> all;
  for (const weft::Fault& fault : simulation.verdict().faults) all.push_back(fault.code);
  return all;
}

TEST(Verdict, TellsWhatIsWrong) {
  Scene scene = around_pole(0.075);  // 19 % too small
  scene.environment.gravity = Vector3d::Zero();
  Simulation tight(scene);
  dress(tight, 1);
  EXPECT_EQ(codes(tight), (std::vector<std::string>{"NOT_DRESSED", "NOT_AT_REST"}));
  dress(tight, 150);
  EXPECT_EQ(codes(tight), (std::vector<std::string>{"NOT_AT_REST", "TOO_TIGHT"}));

  scene = around_pole(0.03);  // far too wide: it falls off
  scene.dressing->holds = {{0, {0, 1, 2}, 0.3}};
  Simulation wide(scene);
  dress(wide, 150);
  EXPECT_EQ(codes(wide), (std::vector<std::string>{"NOT_AT_REST", "SLID_DOWN", "BESIDE_BODY"}));
  EXPECT_THAT(wide.verdict().faults[1].message, ::testing::EndsWith("or too smooth"));
  scene.solver.max_self_weight_strain = 0.01;
  Simulation soft(scene);
  dress(soft, 150);
  EXPECT_THAT(soft.verdict().faults[1].message, ::testing::HasSubstr("its stretch capped"));

  scene.solver.max_self_weight_strain.reset();
  scene.dressing->holds.clear();
  Simulation falling(scene);
  dress(falling, 150);
  EXPECT_EQ(codes(falling), (std::vector<std::string>{"NOT_AT_REST", "SLID_DOWN", "BESIDE_BODY"}));
  EXPECT_THAT(falling.verdict().faults[1].message, ::testing::HasSubstr("nothing holds it up"));
}

TEST(Verdict, ATubeThatClosesBesideAPoleIsBesideIt) {
  Scene scene = around_pole(0.05);
  scene.environment.gravity = Vector3d::Zero();
  std::get<Capsule>(scene.colliders[0].shape) = {Vector3d(0.3, -1, 0), Vector3d(0.3, 1, 0), 0.05};
  Simulation simulation(scene);
  dress(simulation, 1);
  EXPECT_EQ(codes(simulation), (std::vector<std::string>{"NOT_DRESSED", "NOT_AT_REST"}));
  dress(simulation, 150);
  EXPECT_EQ(codes(simulation), (std::vector<std::string>{"NOT_AT_REST", "BESIDE_BODY"}));
  EXPECT_THAT(simulation.verdict().faults[1].message,
              ::testing::AllOf(::testing::StartsWith("2 borders go around no part of a body"),
                               ::testing::HasSubstr(" mm in panel \"")));
}

TEST(Verdict, KnitsFitWhereWovensAreTooTight) {
  const auto fault_of = [](double tensile, double radius) {
    Scene scene = around_pole(radius);
    scene.environment.gravity = Vector3d::Zero();
    auto& textile = std::get<MeasuredTextile>(scene.sheets[0].textile.model);
    textile.tensile_warp = textile.tensile_weft = tensile;
    Simulation simulation(scene);
    dress(simulation, 150);
    const auto faults = simulation.verdict().faults;
    const auto tight = std::ranges::find(faults, "TOO_TIGHT", &weft::Fault::code);
    return tight == faults.end() ? "" : tight->message;
  };
  EXPECT_EQ(fault_of(60, 0.075), "");  // stretched by a fifth
  EXPECT_THAT(fault_of(1000, 0.075), ::testing::HasSubstr("more than 10 %"));
  EXPECT_THAT(fault_of(60, 0.09), ::testing::HasSubstr("more than 30 %"));
}

// A triangle that is stretched by a fifth, and 200 that are not, of 1 % of its size together.
TEST(Verdict, StrainIsOfTheClothHoweverItIsDividedIntoTriangles) {
  Scene scene = around_pole(0.05);
  scene.dressing.reset();
  scene.colliders.clear();
  SheetDefinition fine = scene.sheets[0];
  fine.name = "fine";
  fine.shape = Grid{11, 11, 0.001};
  SheetDefinition coarse = scene.sheets[0];
  coarse.name = "coarse";
  TriangleMesh mesh;
  mesh.flat = {{0, 0}, {0.2, 0}, {0, 0.1}};
  mesh.start = {{1, 0, 0}, {1.24, 0, 0}, {1, 0.1, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.panels = {{"sleeve", 1, 0}};
  coarse.shape = complete(mesh);
  scene.sheets = {fine, coarse};
  const Verdict verdict = Simulation(scene).verdict();
  EXPECT_NEAR(verdict.strain_weft, 0.2, 1e-6);
  EXPECT_NEAR(verdict.strain_warp, 0, 1e-6);
  ASSERT_EQ(verdict.faults.size(), 2U);
  EXPECT_EQ(verdict.faults[1].code, "TOO_TIGHT");
  EXPECT_NE(verdict.faults[1].message.find("panel \"sleeve\""), std::string::npos);
}

}  // namespace
}  // namespace weft::testing

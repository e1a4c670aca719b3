#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> bad_fields(const Scene& scene) {
  std::vector<std::string> fields;
  for (const Problem& problem : find_problems(scene)) fields.push_back(problem.field);
  return fields;
}

Scene good() { return floating(flat_sheet(3, 4)); }

TEST(Problems, AGoodSceneHasNone) { EXPECT_THAT(bad_fields(good()), IsEmpty()); }

TEST(Problems, EveryOneIsFoundAndNamesFieldValueAndBounds) {
  Scene scene = good();
  std::get<Grid>(scene.sheets[0].shape).spacing = -0.5;
  std::get<RawTextile>(scene.sheets[0].textile.model).bend =
      std::numeric_limits<double>::quiet_NaN();
  scene.solver.frame_step = 11;
  const auto problems = find_problems(scene);
  ASSERT_EQ(problems.size(), 3u);
  EXPECT_EQ(problems[0].field, "sheets[0].grid.spacing_m");
  EXPECT_EQ(problems[0].message, "-0.5 m is not within 1e-05 to 10 m");
  EXPECT_EQ(problems[1].field, "sheets[0].textile.raw.bend_n_m2");
  EXPECT_THAT(problems[1].message, HasSubstr("nan"));
  EXPECT_EQ(problems[2].field, "solver.frame_step_s");
}

TEST(Problems, OptimalBreakpointsAreForLineSegmentsOfTheUnclampedFunction) {
  Scene scene = good();
  const auto bad = [&](const ChoiKo& law) {
    scene.sheets[0].bending = law;
    return bad_fields(scene);
  };
  const std::string field = "sheets[0].bending.choi_ko.optimal_breakpoints";
  EXPECT_THAT(bad({.optimal_breakpoints = true}), IsEmpty());
  EXPECT_THAT(bad({.fold_clamp = true, .optimal_breakpoints = true}), ElementsAre(field));
  EXPECT_THAT(bad({.evaluator = Evaluator::kExact, .optimal_breakpoints = true}),
              ElementsAre(field));
}

TEST(Problems, StartPositionsMustBeAsManyAsTheParticlesNeedAndFinite) {
  Scene scene = good();
  scene.sheets[0].start_positions.assign(35, 0);
  EXPECT_THAT(bad_fields(scene), ElementsAre("sheets[0].start_positions_m"));
  scene.sheets[0].start_positions.assign(36, 0);
  scene.sheets[0].start_positions[17] = std::numeric_limits<double>::infinity();
  EXPECT_THAT(bad_fields(scene), ElementsAre("sheets[0].start_positions_m[17]"));
}

TEST(Problems, PinsHoldParticlesThatExistAndEachOnce) {
  Scene scene = good();
  scene.sheets[0].pins = {{{0, 12, -1}, {}}, {{3, 0}, {}}, {{}, {}}};
  EXPECT_THAT(bad_fields(scene),
              ElementsAre("sheets[0].pins[0].particles[1]", "sheets[0].pins[0].particles[2]",
                          "sheets[0].pins[1].particles[1]", "sheets[0].pins[2].particles"));
}

TEST(Problems, KeyframesFollowEachOther) {
  Scene scene = good();
  scene.sheets[0].pins = {{{0}, {{1, Vector3d::Zero()}, {1, Vector3d::Zero()}}}};
  EXPECT_THAT(bad_fields(scene), ElementsAre("sheets[0].pins[0].path[1].time_s"));
}

TEST(Problems, CollidersMoveNoFasterThanContactFollows) {
  Scene scene = good();
  scene.colliders = {{"ball", Sphere{Vector3d::Zero(), 0.1}, 0.3, {}}};
  scene.colliders[0].path = {{0, Vector3d::Zero()}, {0.01, Vector3d(0, 1, 0)}};
  EXPECT_THAT(bad_fields(scene), IsEmpty());
  scene.colliders[0].path.push_back({0.02, Vector3d(0, 2.5, 0)});
  const auto problems = find_problems(scene);
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_EQ(problems[0].field, "colliders[0].path[2].offset_m");
  EXPECT_EQ(problems[0].message, "moves 1.5 m in 0.01 s, 150 m/s; colliders move at most 100 m/s");
}

TEST(Problems, NamesAreUniqueAndWellFormed) {
  Scene scene = good();
  scene.sheets.push_back(scene.sheets[0]);
  scene.sheets.push_back(scene.sheets[0]);
  scene.sheets[2].name = "A b";
  EXPECT_THAT(bad_fields(scene), ElementsAre("sheets[1].name", "sheets[2].name"));
}

TEST(Problems, DirectionsMustNotBeZero) {
  Scene scene = good();
  scene.colliders = {
      {"floor", Plane{Vector3d::Zero(), Vector3d::Zero()}, 0.3, {}},
      {"table", Box{Vector3d::Zero(), Vector3d(1, 1, 1), Quaterniond(0, 0, 0, 0)}, 0.3, {}}};
  EXPECT_THAT(bad_fields(scene),
              ElementsAre("colliders[0].plane.normal", "colliders[1].box.rotation"));
}

TEST(Problems, AHugeListOfThemIsCut) {
  Scene scene = good();
  scene.sheets[0].shape = Grid{100, 100, 0.01};
  scene.sheets[0].start_positions.assign(30000, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(find_problems(scene).size(), 1000u);
}

}  // namespace
}  // namespace weft::testing

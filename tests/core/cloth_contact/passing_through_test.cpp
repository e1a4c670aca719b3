#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <variant>

#include "core/cloth_contact/cloth_contact.h"
#include "tests/support/core/bodies.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/touching_sheets.h"

namespace weft::testing {
namespace {

TEST(ClothContact, AStripTwistedAndBackDoesNotPassThroughItself) {
  SheetDefinition band = soft_rectangle(0.2, 0.1);
  Matrix3Xd x = start_positions(band);
  constexpr double kTurns = 1.5, kTime = 1.0;
  const double length = 0.2, middle = 0.05;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const double end = x(0, i) < 1e-9 ? -1 : x(0, i) > length - 1e-9 ? 1 : 0;
    if (end == 0) continue;
    Pin& pin = band.pins.emplace_back();
    pin.particles = {static_cast<int>(i)};
    constexpr int kKeys = 200;
    for (int k = 0; k <= kKeys; ++k) {
      const double share = 1 - std::abs(1 - 2.0 * k / kKeys);
      const double angle = end * std::numbers::pi * kTurns * share, z = x(2, i) - middle;
      pin.path.push_back(
          {kTime * k / kKeys, {-end * 0.04 * share, z * std::sin(angle), z * std::cos(angle) - z}});
    }
  }
  band.start_positions = values((x + 1e-5 * noise(static_cast<int>(x.cols()))).eval());
  Scene scene = touching({band});
  scene.environment.gravity.setZero();
  Simulation simulation(scene);
  std::int64_t cuts = 0;
  for (int frame = 0; frame < 66; ++frame) {
    ASSERT_TRUE(simulation.advance_frame());
    cuts += cuts_now(simulation);
  }
  EXPECT_EQ(cuts, 0);
}

TEST(ClothContact, ASheetPouredIntoAHeapDoesNotPassThroughItself) {
  SheetDefinition sheet = soft_rectangle(0.2, 0.2);
  const Matrix3Xd flat = start_positions(sheet);
  Matrix3Xd upright(3, flat.cols());
  for (Eigen::Index i = 0; i < flat.cols(); ++i)
    upright.col(i) = Vector3d(flat(0, i), flat(2, i) + 0.01, 0.01 * std::sin(40 * flat(2, i)));
  sheet.start_positions = values(upright);
  Scene scene = touching({sheet});
  scene.colliders.push_back({"floor", Plane{}, 0.5, {}});
  Simulation simulation(scene);
  std::int64_t cuts = 0;
  for (int frame = 0; frame < 45; ++frame) {
    ASSERT_TRUE(simulation.advance_frame());
    cuts += cuts_now(simulation);
  }
  EXPECT_EQ(cuts, 0);
  EXPECT_LT(positions(simulation).row(1).maxCoeff(), 0.1);
}

// Upright, in waves, on a floor; in steps that are long for its crumpling.
Scene crumpling() {
  SheetDefinition sheet = soft_rectangle(0.15, 0.15, 0.0125);
  std::get<MeasuredTextile>(sheet.textile.model) = light_textile(0.2);
  Matrix3Xd x = start_positions(sheet);
  for (auto at : x.colwise())
    at = Vector3d(at.x(), at.z() + 0.01,
                  0.02 * std::sin(20 * at.z()) + 1e-3 * std::sin(200 * at.x()));
  sheet.start_positions = values(x);
  Scene scene = touching({sheet});
  scene.colliders.push_back({"floor", Plane{}, 0.5, {}});
  scene.solver = default_settings(Accuracy::kDraft);
  return scene;
}

TEST(ClothContact, AFrameInWhichClothPassesThroughItselfIsComputedAgainInShorterSteps) {
  Scene unguarded = crumpling();
  unguarded.solver.max_repairs = 0;
  Simulation simulation(crumpling()), passes(unguarded);
  std::int64_t cuts = 0, cuts_unguarded = 0;
  for (int frame = 0; frame < 15; ++frame) {
    ASSERT_TRUE(simulation.advance_frame());
    ASSERT_TRUE(passes.advance_frame());
    cuts += cuts_now(simulation);
    cuts_unguarded += cuts_now(passes);
  }
  EXPECT_GT(cuts_unguarded, 0);
  EXPECT_EQ(cuts, 0);
  ASSERT_EQ(simulation.repairs().size(), 1u);
  EXPECT_THAT(simulation.repairs()[0].reason,
              ::testing::MatchesRegex("[0-9]+ cuts, where the frame began with none"));
}

// The energy that it gets is no fault of the step.
TEST(ClothContact, ASheetThatAnotherDrawsAlongNeedsNoRepair) {
  SheetDefinition cloth = soft_rectangle(0.3, 0.08), napkin = soft_rectangle(0.04, 0.04);
  napkin.name = "napkin";
  napkin.origin = {0.05, 2e-3, 0.02};
  const Matrix3Xd x = start_positions(cloth);
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    if (x(0, i) < 0.3 - 1e-9) continue;
    Pin& pin = cloth.pins.emplace_back();
    pin.particles = {static_cast<int>(i)};
    for (int k = 0; k <= 100; ++k) pin.path.push_back({0.01 * k, {0.4 * k * k * 1e-4, 0, 0}});
  }
  Scene scene = touching({cloth, napkin});
  scene.colliders.push_back({"table", Plane{Vector3d(0, -1e-3, 0)}, 0.2, {}});
  Simulation simulation(scene);
  const Vector3d before = by_sheet(simulation, positions(simulation))[1].rowwise().mean();
  for (int frame = 0; frame < 60; ++frame) ASSERT_TRUE(simulation.advance_frame());
  const Vector3d after = by_sheet(simulation, positions(simulation))[1].rowwise().mean();
  EXPECT_GT((after - before).x(), 0.3);
  EXPECT_EQ(simulation.repairs().size(), 0u);
}

TEST(ClothContact, CutsOfAFrameAreAmongItsFacts) {
  SheetDefinition one = soft_rectangle(0.1, 0.1), other = soft_lattice(5, 5);
  other.origin = {0.03, -0.02, 0.04};
  other.rotation = Quaterniond(Eigen::AngleAxisd(-1.2, Vector3d::UnitX()));
  Scene scene = touching({one, other});
  const Simulation tangled(scene);
  EXPECT_GT(tangled.stats().cloth_cuts, 0);
  EXPECT_EQ(tangled.stats().cloth_cuts, cuts_now(tangled));
  scene.sheets[1].origin.y() = 0.1;
  EXPECT_EQ(Simulation(scene).stats().cloth_cuts, 0);
  scene.cloth_contact = false;
  EXPECT_EQ(Simulation(scene).stats().cloth_cuts, std::nullopt);
}

}  // namespace
}  // namespace weft::testing

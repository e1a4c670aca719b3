#include "core/forces/air.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

SheetDefinition airy_sheet(int rows, int columns, double spacing, double drag) {
  SheetDefinition sheet = flat_sheet(rows, columns, spacing);
  sheet.textile = {MeasuredTextile{.areal_density = 0.2, .air_drag = drag}, 0, 0};
  return sheet;
}

// v(t) = v0 exp(-c t / rho), whatever the mesh.
TEST(Air, DragSlowsASheetAsTheExponentialSaysOnEveryMesh) {
  for (const auto& [particles, spacing] : {std::pair(3, 0.1), std::pair(9, 0.025)}) {
    SheetDefinition sheet = airy_sheet(particles, particles, spacing, 0.5);
    sheet.start_velocities = values(Vector3d(0, 0, 2).replicate(1, particles * particles));
    Scene scene = floating(sheet);
    scene.solver.substep = 1e-3;
    Simulation simulation(scene);
    for (int frame = 0; frame < 50; ++frame) ASSERT_TRUE(simulation.advance_frame());
    EXPECT_NEAR(velocities(simulation)(2, 4), 2 * std::exp(-0.5 * 0.5 / 0.2), 5e-6);
  }
}

TEST(Air, AFallingSheetReachesTheSpeedAtWhichDragCarriesIt) {
  Scene scene = floating(airy_sheet(4, 4, 0.05, 0.5));
  scene.environment.gravity = {0, -9.8, 0};
  scene.solver.substep = 1e-3;
  Simulation simulation(scene);
  for (int frame = 0; frame < 600; ++frame) ASSERT_TRUE(simulation.advance_frame());
  EXPECT_NEAR(velocities(simulation)(1, 5), -0.2 * 9.8 / 0.5, 1e-5);
}

Vector3d wind_force(const Wind& wind, int particles, double spacing) {
  const SheetDefinition sheet = airy_sheet(particles, particles, spacing, 0);
  const Matrix3Xd x = start_positions(sheet), v = Matrix3Xd::Zero(3, x.cols());
  Matrix3Xd force = Matrix3Xd::Zero(3, x.cols());
  add_wind_forces(wind, make_lattice(sheet), 0, 0, x, v, force);
  return force.rowwise().sum();
}

// F = 1/2 rho A v^2 on a flat sheet across the wind, c_t A v along it; on every mesh.
TEST(Air, WindPushesAFlatSheetWithTheForceOfItsArea) {
  for (const auto& [particles, spacing] : {std::pair(5, 0.1), std::pair(17, 0.025)}) {
    const Wind across{.velocity = Vector3d(0, -5, 0), .air_density = 1.2};
    EXPECT_NEAR(wind_force(across, particles, spacing).y(), -0.5 * 1.2 * 0.16 * 25, 1e-12);
    const Wind along{.velocity = Vector3d(3, 0, 0), .tangential_drag = 0.02};
    EXPECT_NEAR(wind_force(along, particles, spacing).x(), 0.02 * 0.16 * 3, 1e-12);
    EXPECT_NEAR(wind_force(along, particles, spacing).y(), 0, 1e-15);
  }
}

TEST(Air, GustsSwingTheWindAroundItsMean) {
  const Wind wind{.velocity = Vector3d(2, 0, 0), .gust = 0.5, .gust_period = 4};
  EXPECT_NEAR(air_velocity(wind, 0).x(), 2, 1e-15);
  EXPECT_NEAR(air_velocity(wind, 1).x(), 3, 1e-15);
  EXPECT_NEAR(air_velocity(wind, 3).x(), 1, 1e-15);
}

TEST(Air, AFreeSheetIsCarriedAlongByTheWindUntilItMovesWithIt) {
  Scene scene = floating(airy_sheet(5, 5, 0.05, 0.5));
  scene.environment.wind = Wind{.velocity = Vector3d(1, -2, 0.5)};
  Simulation simulation(scene);
  for (int frame = 0; frame < 1000; ++frame) ASSERT_TRUE(simulation.advance_frame());
  EXPECT_LT((velocities(simulation).colwise() - Vector3d(1, -2, 0.5)).cwiseAbs().maxCoeff(), 1e-6);
}

}  // namespace
}  // namespace weft::testing

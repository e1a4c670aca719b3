#include "core/frame_values.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <memory>

#include "core/simulation.h"
#include "tests/support/core/bodies.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

constexpr double kPatchDensity = 0.2;  // kg/m^2

SheetDefinition patch(const SheetShape& shape) {
  SheetDefinition sheet;
  sheet.name = "patch";
  sheet.shape = shape;
  sheet.textile.model = light_textile(kPatchDensity);
  sheet.bending = Isometric{};
  sheet.skin = 0.001;
  sheet.origin = {0, 0.0011, 0};
  return sheet;
}

// 0.2 m wide.
std::vector<SheetShape> patches() {
  TriangleMesh mesh;
  constexpr int kSide = 11;
  for (int row = 0; row < kSide; ++row)
    for (int column = 0; column < kSide; ++column)
      mesh.start.emplace_back(0.02 * column, 0, 0.02 * row);
  for (int row = 0; row + 1 < kSide; ++row)
    for (int column = 0; column + 1 < kSide; ++column) {
      const int i = row * kSide + column;
      mesh.triangles.push_back({i, i + kSide, i + kSide + 1});
      mesh.triangles.push_back({i, i + kSide + 1, i + 1});
    }
  return {Grid{kSide, kSide, 0.02}, complete(std::move(mesh))};
}

std::vector<double> planes(const Matrix3Xd& x) {
  const Eigen::MatrixX3d rows = x.transpose();
  return {rows.data(), rows.data() + rows.size()};
}

Collider table() { return {"table", Plane{}, 0.3, {}}; }

TEST(FrameValues, APatchAtRestOnATablePressesWithItsWeightOverItsArea) {
  for (const SheetShape& shape : patches()) {
    Scene scene;
    scene.sheets = {patch(shape)};
    scene.colliders = {table()};
    Simulation simulation(scene);
    for (int frame = 0; frame < 60; ++frame) ASSERT_TRUE(simulation.advance_frame());
    FrameMeter meter(scene);
    const Matrix3Xd x = positions(simulation);
    const auto pressures =
        meter.pressures(simulation.scene_of_frame(), planes(x), simulation.time());
    ASSERT_EQ(pressures.size(), 121U);
    for (const double pressure : pressures)
      EXPECT_NEAR(pressure, kPatchDensity * kStandardGravity,
                  0.01 * kPatchDensity * kStandardGravity);
    for (const double clearance :
         meter.clearances(simulation.scene_of_frame(), planes(x), simulation.time()))
      EXPECT_NEAR(clearance, 0.001, 1e-6);
    EXPECT_EQ(simulation.verdict().largest_pressure,
              *std::max_element(pressures.begin(), pressures.end()));
  }
}

TEST(FrameValues, WhatTouchesNothingIsNotPressed) {
  Scene scene;
  scene.sheets = {patch(patches()[1])};
  scene.sheets[0].origin = {0, 0.3, 0};
  scene.colliders = {table()};
  const Matrix3Xd x = start_positions(scene.sheets[0]);
  FrameMeter meter(scene);
  const auto shared = std::make_shared<const Scene>(scene);
  EXPECT_THAT(meter.pressures(shared, planes(x), 0), ::testing::Each(0));
  EXPECT_THAT(meter.clearances(shared, planes(x), 0),
              ::testing::Each(::testing::DoubleNear(0.3, 1e-12)));
}

TEST(FrameValues, ClearanceIsTheDistanceFromTheExactSphere) {
  constexpr double kRadius = 0.15;
  const Vector3d center(0.02, 0.1, -0.05);
  BodyMesh ball = ball_mesh(kRadius, 4);
  ASSERT_EQ(ball.triangles.size(), 5120U);
  for (Vector3d& vertex : ball.vertices) vertex += center;
  Scene scene;
  scene.sheets = {patch(patches()[0])};
  const Matrix3Xd x = 0.4 * noise(121);  // deep inside, near, and far from the grid
  for (const bool exact : {true, false}) {
    scene.colliders = {exact ? Collider{"ball", Sphere{center, kRadius}, 0.3, {}} : solid(ball)};
    FrameMeter meter(scene);
    const auto found = meter.clearances(std::make_shared<const Scene>(scene), planes(x), 0);
    int inside = 0;
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
      const double wanted = (x.col(i) - center).norm() - kRadius;
      EXPECT_NEAR(found[static_cast<std::size_t>(i)], wanted, exact ? 1e-12 : 2e-4);
      if (wanted < 0) ++inside;
    }
    EXPECT_GT(inside, 3);
    EXPECT_LT(inside, 100);
  }
}

TEST(FrameValues, ClearanceFollowsABodyThroughItsPosesAndAlongItsPath) {
  Collider body =
      posed(box_mesh({0.1, 0.05, 0.08}), {0, 0.5, 1}, [](const Vector3d& vertex, double time) {
        return Vector3d(Eigen::AngleAxisd(0.6 * time, Vector3d::UnitZ()) * vertex +
                        Vector3d(0.2 * time, 0, 0));
      });
  body.path = {{0, Vector3d::Zero()}, {1, {0, 0.1, 0}}};
  Scene scene;
  scene.sheets = {patch(patches()[0])};
  scene.colliders = {body};
  const Matrix3Xd x = 0.4 * noise(121, 7);
  FrameMeter meter(scene);
  const auto shared = std::make_shared<const Scene>(scene);
  for (const double time : {0.0, 0.3, 0.5, 0.9, 2.0}) {
    const auto found = meter.clearances(shared, planes(x), time);
    const BodyMesh mesh = mesh_at(body, time);
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      EXPECT_NEAR(found[static_cast<std::size_t>(i)],
                  signed_distance(mesh, x.col(i) - offset_at(body.path, time)), 1e-7);
  }
}

TEST(FrameValues, AreThoseOfTheTextileThatTheFrameHad) {
  Scene scene;
  scene.sheets = {patch(patches()[1])};
  scene.colliders = {table()};
  Simulation simulation(scene);
  for (int frame = 0; frame < 30; ++frame) ASSERT_TRUE(simulation.advance_frame());
  const auto before = simulation.scene_of_frame();
  const auto x = planes(positions(simulation));
  EXPECT_EQ(simulation.scene_of_frame(), before);
  Textile heavy = scene.sheets[0].textile;
  std::get<MeasuredTextile>(heavy.model).areal_density *= 3;
  ASSERT_FALSE(simulation.set_textile(0, heavy));
  const auto after = simulation.scene_of_frame();
  FrameMeter meter(scene);
  const double light = meter.pressures(before, x, simulation.time())[60];
  EXPECT_NEAR(meter.pressures(after, x, simulation.time())[60], 3 * light, 0.05 * light);
  EXPECT_EQ(meter.pressures(before, x, simulation.time())[60], light);
  EXPECT_EQ(simulation.pressures(0)[60],
            meter.pressures(after, planes(positions(simulation)), simulation.time())[60]);
}

}  // namespace
}  // namespace weft::testing

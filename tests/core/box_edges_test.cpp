#include "core/box_edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "core/forces/elastic.h"
#include "core/triangles/cut.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

SheetDefinition coarse_cloth(const std::string& kind, double side, double spacing = 0.03) {
  SheetDefinition sheet;
  sheet.name = kind;
  sheet.textile.model = light_textile(0.2);
  sheet.bending = Isometric{};
  const int n = static_cast<int>(std::lround(side / spacing)) + 1;
  if (kind == "lattice")
    sheet.shape = Grid{n, n, spacing};
  else
    sheet.shape = complete(triangle_mesh(cut_rectangle(Cut::kAlternating, side, side, spacing)));
  return sheet;
}

Scene over_box(const SheetDefinition& sheet, const Box& box) {
  Scene scene = floating(sheet);
  scene.environment.gravity = {0, -9.81, 0};
  scene.colliders = {{"box", box, 0.3, {}}};
  return scene;
}

// How deep triangles are in a box, at most, m.
double deepest_in(const Scene& scene, const Matrix3Xd& x) {
  constexpr int kParts = 30;
  double deepest = 0;
  for (const auto& [i, j, k] : triangles_of(scene.sheets[0].shape))
    for (int a = 0; a <= kParts; ++a)
      for (int b = 0; a + b <= kParts; ++b) {
        const double u = double(a) / kParts, v = double(b) / kParts;
        const Vector3d at = (1 - u - v) * x.col(i) + u * x.col(j) + v * x.col(k);
        deepest = std::max(deepest, -distance(std::get<Box>(scene.colliders[0].shape), at).value);
      }
  return deepest;
}

constexpr const char* kKinds[] = {"lattice", "triangles"};

TEST(BoxEdges, DoNotCutCoarseClothThatLiesOverThem) {
  for (const std::string kind : kKinds) {
    SCOPED_TRACE(kind);
    SheetDefinition sheet = coarse_cloth(kind, 0.6);
    sheet.origin = {-0.31, 0.01, -0.29};
    sheet.rotation = Quaterniond(Eigen::AngleAxisd(0.2, Vector3d::UnitY()));
    const Scene scene = over_box(sheet, {{0, -0.2, 0}, {0.15, 0.2, 0.15}});
    Simulation simulation(scene);
    for (int frame = 1; frame <= 60; ++frame) {
      ASSERT_TRUE(simulation.advance_frame());
      if (frame % 10 == 0) {
        EXPECT_EQ(deepest_in(scene, positions(simulation)), 0) << frame;
      }
    }
    // it hangs over all four
    EXPECT_LT(positions(simulation).row(1).minCoeff(), -0.15);
  }
}

TEST(BoxEdges, DoNotCutClothThatSagsOntoACorner) {
  for (const std::string kind : kKinds) {
    SCOPED_TRACE(kind);
    SheetDefinition sheet = coarse_cloth(kind, 0.4, 0.05);
    sheet.origin = {-0.19, 0.01, -0.22};
    const Matrix3Xd x = start_positions(sheet);
    for (const double side : {x.row(0).minCoeff(), x.row(0).maxCoeff()})
      for (Eigen::Index i = 0; i < x.cols(); ++i)
        if (std::abs(x(0, i) - side) < 1e-9) sheet.pins.push_back({{static_cast<int>(i)}, {}});
    const Quaterniond up = Quaterniond::FromTwoVectors(Vector3d(1, 1, 1), Vector3d(0.1, 1, -0.05));
    const double half = 0.1;
    const Scene scene =
        over_box(sheet, {{0, -half * std::sqrt(3.0), 0}, Vector3d::Constant(half), up});
    Simulation simulation(scene);
    for (int frame = 1; frame <= 40; ++frame) {
      ASSERT_TRUE(simulation.advance_frame());
      if (frame % 10 == 0) {
        EXPECT_EQ(deepest_in(scene, positions(simulation)), 0) << frame;
      }
    }
  }
}

TEST(BoxEdges, LetGoOfClothThatIsDrawnOverThem) {
  for (const std::string kind : kKinds) {
    SCOPED_TRACE(kind);
    SheetDefinition sheet = coarse_cloth(kind, 0.4, 0.02);
    sheet.origin = {-0.21, 0.01, -0.2};
    const Matrix3Xd x = start_positions(sheet);
    Pin pin;
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      if (x(0, i) > x.row(0).maxCoeff() - 1e-9) pin.particles.push_back(static_cast<int>(i));
    pin.path = {
        {0, Vector3d::Zero()}, {0.4, Vector3d(0, -0.1, 0)}, {1.0, Vector3d(0.5, -0.3, 0.1)}};
    sheet.pins = {pin};
    const Scene scene = over_box(sheet, {{0, -0.2, 0}, {0.15, 0.2, 0.1}});
    Simulation simulation(scene);
    const Mesh mesh = make_mesh(sheet);
    double stretch = 0;
    for (int frame = 1; frame <= 75; ++frame) {
      ASSERT_TRUE(simulation.advance_frame());
      stretch = std::max(stretch, largest_strain(mesh, positions(simulation)));
      if (frame % 15 == 0) {
        EXPECT_EQ(deepest_in(scene, positions(simulation)), 0) << frame;
      }
    }
    EXPECT_LT(stretch, 0.12);
    EXPECT_GT(positions(simulation).row(0).minCoeff(), 0.15);  // beyond the box
  }
}

// One hand more of it hangs on one side than on the other.
TEST(BoxEdges, RubOnClothThatHangsUnevenlyOverThem) {
  for (const std::string kind : kKinds) {
    SCOPED_TRACE(kind);
    SheetDefinition sheet = coarse_cloth(kind, 0.6);
    sheet.origin = {-0.25, 0.01, -0.29};
    sheet.textile.damping_ratio = 0.02;
    const Scene scene = over_box(sheet, {{0, -0.2, 0}, {0.15, 0.2, 0.15}});
    Simulation simulation(scene);
    for (int frame = 0; frame < 90; ++frame) ASSERT_TRUE(simulation.advance_frame());
    const Vector3d before = positions(simulation).rowwise().mean();
    for (int frame = 0; frame < 90; ++frame) ASSERT_TRUE(simulation.advance_frame());
    const Vector3d after = positions(simulation).rowwise().mean();
    EXPECT_LT((after - before).norm(), 3e-3);
  }
}

// The paper's sheet and table, a damping of a thousandth of critical.
TEST(BoxEdges, GiveNoEnergyToClothThatComesToRestOverThem) {
  SheetDefinition sheet = flat_sheet(31, 31);
  sheet.textile = paper_textile();
  std::get<RawTextile>(sheet.textile.model).air_drag = 1e-3;
  sheet.origin = {-0.5, 0.405, -0.5};
  Scene scene = over_box(sheet, {{0, 0.2, 0}, {0.25, 0.2, 0.25}});
  scene.solver.frame_step = 0.1;
  Simulation simulation(scene);
  while (!simulation.at_rest() && simulation.frame() < 100) ASSERT_TRUE(simulation.advance_frame());
  EXPECT_TRUE(simulation.at_rest());
}

TEST(BoxEdges, KeepBitsOverASnapshot) {
  for (const std::string kind : kKinds) {
    SCOPED_TRACE(kind);
    SheetDefinition sheet = coarse_cloth(kind, 0.3);
    sheet.origin = {-0.16, 0.005, -0.14};
    const Scene scene = over_box(sheet, {{0, -0.2, 0}, {0.07, 0.2, 0.07}});
    Simulation one(scene), other(scene);
    for (int frame = 0; frame < 10; ++frame) ASSERT_TRUE(one.advance_frame());
    ASSERT_TRUE(other.restore(one.snapshot()));
    one.release_memory();
    for (int frame = 0; frame < 5; ++frame) {
      ASSERT_TRUE(one.advance_frame());
      ASSERT_TRUE(other.advance_frame());
    }
    EXPECT_EQ(positions(one), positions(other));
  }
}

}  // namespace
}  // namespace weft::testing

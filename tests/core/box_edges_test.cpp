#include "core/box_edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/triangles/cut.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

constexpr double kCoarse = 0.025;  // m
const Box kTableBlock{{0, -0.1, 0}, {0.1, 0.1, 0.1}};

SheetDefinition coarse_cloth(bool lattice, double width = 0.3, double spacing = kCoarse) {
  SheetDefinition sheet;
  sheet.name = "cloth";
  if (lattice) {
    const int n = static_cast<int>(std::lround(width / spacing)) + 1;
    sheet.shape = Grid{n, n, spacing};
  } else {
    sheet.shape = complete(triangle_mesh(cut_rectangle(Cut::kAlternating, width, width, spacing)));
  }
  sheet.textile.model = light_textile(0.2);
  sheet.textile.damping_ratio = 0.05;
  sheet.bending = Isometric{};
  sheet.skin = 1e-3;
  return sheet;
}

Scene over_a_block(bool lattice) {
  SheetDefinition sheet = coarse_cloth(lattice);
  sheet.origin = {-0.14, 0.01, -0.155};
  Scene scene = floating(sheet);
  scene.cloth_contact = true;
  scene.environment.gravity = {0, -9.8, 0};
  scene.colliders = {{"block", kTableBlock, 0.3, {}}};
  return scene;
}

// One border is led over an edge of the block, and down; in the end it draws all of it off.
Scene drawn_over_an_edge(bool lattice) {
  Scene scene = over_a_block(lattice);
  SheetDefinition& sheet = scene.sheets[0];
  sheet.origin = {-0.19, 0.002, -0.155};
  const Matrix3Xd x = start_positions(sheet);
  Pin& border = sheet.pins.emplace_back();
  for (int i = 0; i < sheet.particle_count(); ++i)
    if (x(0, i) > x.row(0).maxCoeff() - 1e-9) border.particles.push_back(i);
  border.path = {
      {0, {0, 0, 0}}, {0.2, {0.03, 0, 0}}, {0.6, {0.07, -0.15, 0}}, {1.5, {0.07, -0.5, 0}}};
  return scene;
}

// Over a blade thinner than a cell that meets no particle, along which weight draws it.
constexpr double kDrawn = 3;  // m/s^2
Scene along_a_blade(bool lattice, double friction) {
  SheetDefinition sheet = coarse_cloth(lattice);
  sheet.origin = {-5.5 * kCoarse, 0.002, -0.15};
  sheet.textile.friction = friction;
  Scene scene = floating(sheet);
  scene.cloth_contact = true;
  scene.environment.gravity = {0, -9, kDrawn};
  scene.colliders = {{"blade", Box{{0, -0.2, 0}, {0.002, 0.2, 3}}, friction, {}}};
  return scene;
}

// A cube on its corner, that rises under cells larger than it is.
constexpr double kHalfCube = 0.03;
const Vector3d kTip{0.013, -0.02, 0.004};
Scene over_a_corner(bool lattice) {
  SheetDefinition sheet = coarse_cloth(lattice, 0.4, 0.1);
  sheet.origin = {-0.2, 0, -0.2};
  Scene scene = floating(sheet);
  scene.cloth_contact = true;
  scene.environment.gravity = {0, -9.8, 0};
  const Vector3d up(0, 1, 0);
  scene.colliders = {{"cube",
                      Box{kTip - std::sqrt(3.0) * kHalfCube * up, Vector3d::Constant(kHalfCube),
                          Quaterniond::FromTwoVectors(Vector3d(1, 1, 1), up)},
                      0.5,
                      {{0, {0, 0, 0}}, {0.5, {0, 0.1, 0}}}}};
  return scene;
}

// How far above the tip of the cube cloth is at least, in any frame, m.
double lowest_over_corner(Scene scene, int frames) {
  Simulation simulation(std::move(scene));
  double least = std::numeric_limits<double>::infinity();
  for (int frame = 0; frame < frames; ++frame) {
    if (!simulation.advance_frame()) return -least;
    const Vector3d tip = kTip + offset_at(simulation.scene().colliders[0].path, simulation.time());
    const Matrix3Xd x = positions(simulation);
    for (const auto& [a, b, c] : triangles_of(simulation.scene().sheets[0].shape)) {
      Eigen::Matrix3d flat;  // corners from above
      flat << x.col(a), x.col(b), x.col(c);
      const Vector3d heights = flat.row(1);
      flat.row(1).setOnes();
      const Vector3d weights = flat.inverse() * Vector3d(tip.x(), 1, tip.z());
      if (weights.minCoeff() >= 0) least = std::min(least, weights.dot(heights) - tip.y());
    }
  }
  return least;
}

// How much longer than at the start an edge of cloth is, in any of the frames.
double longest_stretch(Simulation& simulation, int frames) {
  const SheetDefinition sheet = simulation.scene().sheets[0];
  const Matrix3Xd flat = start_positions(sheet);
  double most = 0;
  for (int frame = 0; frame < frames; ++frame) {
    if (!simulation.advance_frame()) return std::numeric_limits<double>::infinity();
    const Matrix3Xd x = positions(simulation);
    for (const auto& triangle : triangles_of(sheet.shape))
      for (std::size_t k = 0; k < 3; ++k) {
        const int from = triangle[k], to = triangle[(k + 1) % 3];
        most = std::max(
            most, (x.col(to) - x.col(from)).norm() / (flat.col(to) - flat.col(from)).norm() - 1);
      }
  }
  return most;
}

void take_frames(Simulation& simulation, int frames) {
  for (int frame = 0; frame < frames; ++frame) ASSERT_TRUE(simulation.advance_frame());
}

// How deep an edge of cloth is in the box, by points along all of them, m.
double deepest_in_block(const Simulation& simulation, const Vector3d& offset = Vector3d::Zero()) {
  constexpr int kPoints = 100;
  const Matrix3Xd x = positions(simulation);
  double least = 0;
  for (const auto& triangle : triangles_of(simulation.scene().sheets[0].shape))
    for (std::size_t k = 0; k < 3; ++k)
      for (int point = 0; point <= kPoints; ++point) {
        const double share = static_cast<double>(point) / kPoints;
        const Vector3d at = (1 - share) * x.col(triangle[k]) + share * x.col(triangle[(k + 1) % 3]);
        const auto& box = std::get<Box>(simulation.scene().colliders[0].shape);
        least = std::min(least, distance(box, at - offset).value);
      }
  return -least;
}

double deepest_of(Scene scene, int frames) {
  Simulation simulation(std::move(scene));
  double most = 0;
  for (int frame = 0; frame < frames; ++frame) {
    if (!simulation.advance_frame()) return std::numeric_limits<double>::infinity();
    const Collider& block = simulation.scene().colliders[0];
    most = std::max(most, deepest_in_block(simulation, offset_at(block.path, simulation.time())));
  }
  return most;
}

class BoxEdgesOf : public ::testing::TestWithParam<bool> {
 protected:
  bool lattice() const { return GetParam(); }
};
INSTANTIATE_TEST_SUITE_P(LatticesAndTriangles, BoxEdgesOf, ::testing::Bool());

TEST_P(BoxEdgesOf, DoNotCutCoarseClothThatFallsOverThem) {
  Scene scene = over_a_block(lattice());
  EXPECT_LT(deepest_of(scene, 60), 1e-4);
  scene.cloth_contact = false;
  EXPECT_GT(deepest_of(scene, 60), 1e-3);
}

TEST_P(BoxEdgesOf, DoNotCutClothThatIsDrawnOverThem) {
  Scene scene = drawn_over_an_edge(lattice());
  EXPECT_LT(deepest_of(scene, 60), 1e-4);
  scene.cloth_contact = false;
  EXPECT_GT(deepest_of(scene, 60), 1e-3);
}

TEST_P(BoxEdgesOf, DoNotCutClothThatTheyAreMovedInto) {
  Scene scene = over_a_block(lattice());
  scene.colliders[0].path = {{0, {0, 0, 0}}, {0.5, {0.1, 0.2, 0}}, {1, {0, 0.1, 0.1}}};
  EXPECT_LT(deepest_of(scene, 60), 1e-4);
}

TEST_P(BoxEdgesOf, LetClothThatIsDrawnOffGo) {
  Scene scene = drawn_over_an_edge(lattice());
  Simulation kept_out(scene);
  EXPECT_LT(longest_stretch(kept_out, 130), 0.1);
  EXPECT_LT(positions(kept_out).row(1).maxCoeff(), -0.1);
  scene.cloth_contact = false;
  Simulation hooked(scene);
  EXPECT_GT(longest_stretch(hooked, 60), 0.5);
}

TEST_P(BoxEdgesOf, HoldClothByFrictionAlone) {
  const auto slid = [](Simulation& simulation) {
    const double start = positions(simulation).row(2).mean();
    take_frames(simulation, 60);
    EXPECT_GT(positions(simulation).row(1).maxCoeff(), 0);
    return positions(simulation).row(2).mean() - start;
  };
  Simulation rough(along_a_blade(lattice(), 0.6)), smooth(along_a_blade(lattice(), 0));
  EXPECT_LT(slid(rough), 0.02);
  const double freely = kDrawn / 2 * std::pow(60 * smooth.scene().solver.frame_step, 2);
  EXPECT_NEAR(slid(smooth), freely, 0.02 * freely);
}

TEST_P(BoxEdgesOf, LetClothComeToRest) {
  Simulation simulation(over_a_block(lattice()));
  take_frames(simulation, 300);
  const Matrix3Xd before = positions(simulation);
  take_frames(simulation, 60);
  EXPECT_LT((positions(simulation) - before).colwise().norm().maxCoeff(), 1e-4);
}

TEST_P(BoxEdgesOf, MeetAtACornerThatLiftsCellsLargerThanTheBox) {
  Scene scene = over_a_corner(lattice());
  EXPECT_GT(lowest_over_corner(scene, 60), 0);
  scene.cloth_contact = false;
  EXPECT_LT(lowest_over_corner(scene, 60), -5e-3);
}

TEST_P(BoxEdgesOf, ARunOverASnapshotIsEqualToTheBit) {
  const Scene scene = drawn_over_an_edge(lattice());
  Simulation one(scene), other(scene);
  take_frames(one, 25);
  ASSERT_TRUE(other.restore(one.snapshot()));
  for (int frame = 0; frame < 10; ++frame) {
    take_frames(one, 1);
    take_frames(other, 1);
    const Matrix3Xd a = positions(one), b = positions(other);
    ASSERT_EQ(std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<std::size_t>(a.size())),
              0);
  }
}

}  // namespace
}  // namespace weft::testing

#include "core/around_bodies.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

namespace weft::testing {
namespace {

constexpr int kColumns = 40, kRows = 24;

// Cloth of a tube about an axis, with a hole of so many cells a side.
SheetDefinition tube(const Vector3d& from, const Vector3d& to, double radius, int hole = 0) {
  const Vector3d along = (to - from) / kRows;
  const Vector3d out = radius * along.unitOrthogonal(), side = along.normalized().cross(out);
  const double width = 2 * std::numbers::pi * radius / kColumns;
  TriangleMesh mesh;
  for (int row = 0; row <= kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const double angle = 2 * std::numbers::pi * column / kColumns;
      mesh.start.push_back(from + row * along + std::cos(angle) * out + std::sin(angle) * side);
    }
    for (int column = 0; column <= kColumns; ++column)
      mesh.flat.emplace_back(width * column, along.norm() * row);
  }
  for (int row = 0; row < kRows; ++row)
    for (int column = 0; column < kColumns; ++column) {
      if (std::abs(2 * row + 1 - kRows) < hole && std::abs(2 * column + 1 - kColumns) < hole)
        continue;
      const auto particle = [&](int r, int c) {
        return (row + r) * kColumns + (column + c) % kColumns;
      };
      const auto corner = [&](int r, int c) { return (row + r) * (kColumns + 1) + column + c; };
      mesh.triangles.push_back({particle(0, 0), particle(0, 1), particle(1, 1)});
      mesh.triangles.push_back({particle(0, 0), particle(1, 1), particle(1, 0)});
      mesh.flat_triangles.push_back({corner(0, 0), corner(0, 1), corner(1, 1)});
      mesh.flat_triangles.push_back({corner(0, 0), corner(1, 1), corner(1, 0)});
    }
  mesh.panels = {{"sleeve", static_cast<int>(mesh.triangles.size()), 0}};
  SheetDefinition sheet;
  sheet.shape = complete(mesh);
  return sheet;
}

std::vector<double> loose_lengths(const SheetDefinition& sheet, const Collider& body) {
  Scene scene;
  scene.sheets = {sheet};
  scene.colliders = {body};
  std::vector<double> lengths;
  for (const LooseBorder& border :
       loose_borders(scene, MovingBodies(scene.colliders), sheet, start_positions(sheet), 0))
    lengths.push_back(border.length);
  return lengths;
}

// A capsule of 1 m along x.
Collider arm() { return {"arm", Capsule{Vector3d::Zero(), Vector3d::UnitX(), 0.04}, 0.3, {}}; }
Vector3d at(double x, double y) { return {x, y, 0}; }

TEST(AroundBodies, ASleeveAroundAnArmIsAroundItAndOneBesideItIsNot) {
  EXPECT_THAT(loose_lengths(tube(at(0.2, 0), at(0.5, 0), 0.07), arm()), ::testing::IsEmpty());
  const double around = 2 * std::numbers::pi * 0.07;
  EXPECT_THAT(loose_lengths(tube(at(0.2, -0.12), at(0.5, -0.12), 0.07), arm()),
              ::testing::ElementsAre(::testing::DoubleNear(around, 0.003),
                                     ::testing::DoubleNear(around, 0.003)));
}

TEST(AroundBodies, ASleeveMayHangLooselyAndAskew) {
  EXPECT_THAT(loose_lengths(tube(at(0.2, -0.1), at(0.5, -0.1), 0.15), arm()), ::testing::IsEmpty());
  EXPECT_THAT(loose_lengths(tube(at(0.3, -0.03), at(0.5, 0.03), 0.08), arm()),
              ::testing::IsEmpty());
}

TEST(AroundBodies, ASleeveMayBeLongerThanTheArm) {
  EXPECT_THAT(loose_lengths(tube(at(0.85, 0), at(1.2, 0), 0.07), arm()), ::testing::IsEmpty());
}

TEST(AroundBodies, AHoodIsAroundAHeadThoughItSlipsOff) {
  const Collider head{"head", Sphere{Vector3d::Zero(), 0.09}, 0.3, {}};
  EXPECT_THAT(loose_lengths(tube(at(-0.15, 0), at(0.05, 0), 0.12), head), ::testing::IsEmpty());
  EXPECT_THAT(loose_lengths(tube(at(0.12, 0), at(0.32, 0), 0.12), head), ::testing::SizeIs(2));
}

TEST(AroundBodies, ASmallHoleIsNotMeantAndALargeOneIs) {
  const auto with_hole = [](int cells) {
    return loose_lengths(tube(at(0.1, 0), at(0.5, 0), 0.1, cells), arm());
  };
  EXPECT_THAT(with_hole(3), ::testing::IsEmpty());  // 0.19 m around
  EXPECT_THAT(with_hole(6), ::testing::SizeIs(1));  // 0.39 m
}

TEST(AroundBodies, ANarrowSleeveIsNoHole) {
  const auto narrow = [](double y) {
    return loose_lengths(tube(at(0.2, y), at(0.5, y), 0.035), arm());  // 0.22 m around
  };
  EXPECT_THAT(narrow(-0.09), ::testing::SizeIs(2));
}

TEST(AroundBodies, ClothWithOneBorderGoesAroundNothing) {
  SheetDefinition square;
  TriangleMesh mesh;
  mesh.start = {at(0.2, 0.1), at(0.5, 0.1), at(0.5, 0.4), at(0.2, 0.4)};
  mesh.flat = {Vector2d(0, 0), Vector2d(0.3, 0), Vector2d(0.3, 0.3), Vector2d(0, 0.3)};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  square.shape = complete(mesh);
  EXPECT_THAT(loose_lengths(square, arm()), ::testing::IsEmpty());
}

}  // namespace
}  // namespace weft::testing

#include "core/cloth_contact/cuts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/cloth_contact/orientation.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

// A square sheet in the plane y = 0 and another one across it, in the plane x = at.
std::vector<SheetDefinition> crossed_sheets(double at, double rise) {
  std::vector<SheetDefinition> sheets(2, flat_sheet(5, 5, 0.1));
  sheets[1].name = "other";
  sheets[1].origin = {at, rise, 0.05};
  sheets[1].rotation = Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitZ());
  return sheets;
}

std::int64_t cuts_of(const std::vector<SheetDefinition>& sheets) {
  std::vector<Matrix3Xd> x;
  for (const SheetDefinition& sheet : sheets) x.push_back(start_positions(sheet));
  return count_cuts(sheets, x).count;
}

TEST(Cuts, SheetsApartHaveNone) {
  EXPECT_EQ(cuts_of({flat_sheet(9, 9)}), 0);
  EXPECT_EQ(cuts_of(crossed_sheets(0.23, 0.01)), 0);
}

// One sheet's five columns stand on end with the middle of a row in the other's plane.
TEST(Cuts, AreCountedWhereASheetStandsInAnother) {
  const std::vector<SheetDefinition> sheets = crossed_sheets(0.23, -0.17);
  std::vector<Matrix3Xd> x{start_positions(sheets[0]), start_positions(sheets[1])};
  const ClothCuts cuts = count_cuts(sheets, x, 2);
  // by hand: the line that both share runs along z from 0.05 to 0.4; the first sheet crosses it
  // with rows at 0.1, 0.2, 0.3 and 0.4 and with four diagonals, of which the one between 0 and 0.1
  // does at 0.077; the other one with columns at 0.05, 0.15, 0.25 and 0.35 and with four diagonals,
  // the last beyond 0.4 or not
  EXPECT_GE(cuts.count, 15);
  EXPECT_LE(cuts.count, 16);
  ASSERT_EQ(cuts.first.size(), 2u);
  EXPECT_EQ(cuts.first[0].edge_sheet, 0u);
  EXPECT_EQ(cuts.first[0].triangle_sheet, 1u);
}

// Crumpled, folded flat, or crumpled with places so coarse that much touches.
TEST(Cuts, AreThoseOfEveryEdgeThroughEveryTriangle) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  int some = 0;
  for (int turn = 0; turn < 60; ++turn) {
    const std::vector<SheetDefinition> sheets{flat_sheet(9, 7, 0.1), flat_sheet(4, 5, 0.1)};
    std::vector<Matrix3Xd> x;
    for (const SheetDefinition& sheet : sheets) {
      Matrix3Xd& own = x.emplace_back(start_positions(sheet));
      for (auto place : own.colwise()) {
        if (turn % 3 == 1) place.y() = 0.02 * std::abs(place.x() - 0.31);
        for (double& at : place) at += (turn % 3 == 1 ? 1e-3 : 0.08) * unit(random);
        if (turn % 3 == 1 && place.x() > 0.31) place.x() = 0.62 - place.x();
        if (turn % 3 == 2) place = (place * 20).array().round() / 20;
      }
    }
    const Cloth cloth(sheets);
    const Matrix3Xd all = cloth.positions(x);
    std::int64_t expected = 0;
    for (const auto& [p, q] : cloth.edges)
      for (const auto& [a, b, c] : cloth.triangles)
        if (p != a && p != b && p != c && q != a && q != b && q != c)
          expected += cuts(all.col(p), all.col(q), all.col(a), all.col(b), all.col(c));
    EXPECT_EQ(count_cuts(sheets, x).count, expected) << turn;
    some += expected > 0;
  }
  EXPECT_GT(some, 40);
}

TEST(Cuts, OfOneEdgeThroughCommonEdgesAndCornersIsOne) {
  const Vector3d a(0, 0, 0), b(1, 0, 0), c(1, 0, 1), d(0, 0, 1), middle(0.5, 0, 0.5);
  const auto through = [](const Vector3d& at, const std::vector<std::array<Vector3d, 3>>& fan) {
    int count = 0;
    for (const auto& [i, j, k] : fan)
      count += cuts(at - Vector3d(0.1, 1, 0.2), at + Vector3d(0.1, 1, 0.2), i, j, k);
    return count;
  };
  EXPECT_EQ(through({0.3, 0, 0.6}, {{a, b, c}, {a, c, d}}), 1);
  EXPECT_EQ(through({0.5, 0, 0.5}, {{a, b, c}, {a, c, d}}), 1);  // in the diagonal
  EXPECT_EQ(
      through({0.5, 0, 0.5}, {{a, b, middle}, {b, c, middle}, {c, d, middle}, {d, a, middle}}),
      1);  // in the corner
  EXPECT_EQ(through({1.5, 0, 0.5}, {{a, b, c}, {a, c, d}}), 0);
}

TEST(Cuts, TouchesAreNone) {
  const Vector3d a(0, 0, 0), b(1, 0, 0), c(0, 0, 1), inside(0.25, 0, 0.25), above(0.2, 1, 0.2);
  EXPECT_FALSE(cuts(inside, above, a, b, c));  // stands on it
  EXPECT_FALSE(cuts(above, inside, a, b, c));
  EXPECT_FALSE(cuts(inside, Vector3d(3, 0, 3), a, b, c));  // lies in it
  EXPECT_FALSE(cuts(a, above, a, b, c));
}

TEST(Cuts, NeedNoMoreThanTheLastBit) {
  const Vector3d a(0.1, 0.1, 0.1), b(1.1, 0.3, 0.2), c(0.2, 0.7, 1.3);
  const Vector3d p(0.3, -2, 0.3);
  // halves and quarters of the corners round nothing away
  const Vector3d in_plane = 0.5 * a + 0.25 * b + 0.25 * c;
  const int side = orientation(a, b, c, in_plane);
  Vector3d beyond = in_plane, before = in_plane;
  for (int k = 0; k < 4; ++k) {
    beyond.y() = std::nextafter(beyond.y(), 9);
    before.y() = std::nextafter(before.y(), -9);
  }
  EXPECT_NE(orientation(a, b, c, beyond), orientation(a, b, c, before));
  EXPECT_LE(std::abs(side), 1);
  EXPECT_NE(cuts(p, beyond, a, b, c), cuts(p, before, a, b, c));
}

}  // namespace
}  // namespace weft::testing

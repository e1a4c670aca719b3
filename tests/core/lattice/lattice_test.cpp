#include "core/lattice/lattice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "core/forces/springs.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

MeasuredTextile worsted() {
  return {.areal_density = 0.168,
          .tensile_warp = 2000,
          .tensile_weft = 1500,
          .shear = 26,
          .bend_rigidity_warp = 5.6e-6,
          .bend_rigidity_weft = 5.0e-6,
          .air_drag = 0.3};
}

SheetDefinition wool_sheet(int rows, int columns, double spacing) {
  SheetDefinition sheet = flat_sheet(rows, columns, spacing);
  sheet.textile.model = worsted();
  return sheet;
}

std::map<FamilyKind, std::size_t> counts(const Mesh& mesh) {
  std::map<FamilyKind, std::size_t> out;
  for (const Family& family : mesh.families) out[family.kind] += family.connections.size();
  return out;
}

TEST(Mesh, ConnectionsComeAsTheyWereAdded) {
  const std::vector<Connection> added = {{0, 1}, {1, 2}, {2, 3}, {4, 5},  {4, 5}, {7, 5},
                                         {6, 4}, {0, 9}, {3, 9}, {10, 3}, {1, 8}, {3, 10}};
  Connections connections;
  EXPECT_TRUE(connections.empty());
  for (const auto& [i, j] : added) connections.add(i, j);
  std::vector<Connection> found;
  for (const Connection& connection : connections) found.push_back(connection);
  EXPECT_EQ(found, added);
  EXPECT_EQ(connections.size(), added.size());
}

TEST(Mesh, APaperSheetHasThePapersConnectionsEachOnce) {
  auto found = counts(make_lattice(flat_sheet(31, 31)));
  EXPECT_EQ(found[FamilyKind::kStretch], 1860u);
  EXPECT_EQ(found[FamilyKind::kShear], 1800u);
  EXPECT_EQ(found[FamilyKind::kBend], 1798u);
  EXPECT_EQ(found[FamilyKind::kDiagonalBend], 1682u);
}

TEST(Mesh, MassAndDragAreThoseOfTheAreaOnEveryMesh) {
  for (const auto& [rows, columns, h] :
       {std::tuple(5, 9, 0.05), std::tuple(9, 17, 0.025), std::tuple(2, 2, 0.1)}) {
    const Mesh mesh = make_lattice(wool_sheet(rows, columns, h));
    const double area = (rows - 1) * (columns - 1) * h * h;
    EXPECT_NEAR(mesh.mass.sum(), 0.168 * area, 1e-15);
    EXPECT_NEAR(mesh.drag.sum(), 0.3 * area, 1e-15);
  }
}

// Stretched by e along one direction while the other keeps its width, a sheet stores (E + ...) e^2
// / 2 per area; with shear 0 it is E alone.
TEST(Mesh, AStretchedSheetStoresTheEnergyOfItsTensileStiffnessOnEveryMesh) {
  const double e = 1e-3;
  for (const auto& [particles, h] : {std::pair(5, 0.05), std::pair(11, 0.02)}) {
    SheetDefinition sheet = wool_sheet(particles, particles, h);
    std::get<MeasuredTextile>(sheet.textile.model).shear = 0;
    const Mesh mesh = make_lattice(sheet);
    const double area = (particles - 1) * (particles - 1) * h * h;
    const Matrix3Xd flat = start_positions(sheet);
    EXPECT_NEAR(
        spring_energy(mesh, Vector3d(1 + e, 1, 1).asDiagonal() * flat) / (2000 * e * e / 2 * area),
        1, 1e-9);
    EXPECT_NEAR(
        spring_energy(mesh, Vector3d(1, 1, 1 + e).asDiagonal() * flat) / (1500 * e * e / 2 * area),
        1, 1e-9);
  }
}

// A small shear angle stores G angle^2 / 2 per area.
TEST(Mesh, AShearedSheetStoresTheEnergyOfItsShearStiffness) {
  const double angle = 1e-3, h = 0.02;
  SheetDefinition sheet = wool_sheet(11, 11, h);
  auto& textile = std::get<MeasuredTextile>(sheet.textile.model);
  textile.bend_rigidity_warp = textile.bend_rigidity_weft =
      0;  // they would hold the short diagonal
  Eigen::Matrix3d shear = Eigen::Matrix3d::Identity();
  shear(0, 2) = angle;
  const double energy = spring_energy(make_lattice(sheet), shear * start_positions(sheet));
  const double area = 100 * h * h;
  EXPECT_NEAR(energy / (26 * angle * angle / 2 * area), 1, 2e-3);
}

// Rolled onto a cylinder of radius R, a sheet stores B / (2 R^2) per area, where the clamp does not
// rule.
double energy_on_cylinder(const BendingLaw& law, int particles, double h, double radius,
                          bool warp) {
  SheetDefinition sheet = wool_sheet(particles, particles, h);
  auto& textile = std::get<MeasuredTextile>(sheet.textile.model);
  textile.tensile_warp = textile.tensile_weft = textile.shear = 1e7;  // the clamp far away
  sheet.bending = law;
  const Mesh mesh = make_lattice(sheet);
  Matrix3Xd x = start_positions(sheet);
  const double half_turn = std::asin(h / (2 * radius));  // chords keep their length
  const int along = warp ? 0 : 2;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const double angle = 2 * half_turn * std::round(x(along, i) / h);
    x(along, i) = radius * std::sin(angle);
    x(1, i) = radius * (1 - std::cos(angle));
  }
  return spring_energy(mesh, x) + isometric_energy(mesh, x);
}

TEST(Mesh, ASheetOnACylinderStoresTheEnergyOfItsBendingRigidity) {
  const ChoiKo axes{.evaluator = Evaluator::kExact, .diagonal_bend = false},
      all{.evaluator = Evaluator::kExact};
  const double h = 0.005, radius = 0.02;
  const int particles = 61;
  const double area = (particles - 1) * (particles - 1) * h * h;
  for (const bool warp : {true, false}) {
    const double rigidity = warp ? 5.6e-6 : 5.0e-6;
    const double expected = rigidity / (2 * radius * radius) * area;
    // at the ends of the strip one particle in each row bends nothing: (n - 2) of (n - 1) cells
    const double ends = (particles - 2.0) / (particles - 1.0);
    EXPECT_NEAR(energy_on_cylinder(axes, particles, h, radius, warp) / (expected * ends), 1, 0.02);
    EXPECT_NEAR(energy_on_cylinder(Isometric{}, particles, h, radius, warp) / (expected * ends), 1,
                0.02);
    EXPECT_NEAR(energy_on_cylinder(all, particles, h, radius, warp) / (expected * ends), 1, 0.04);
  }
}

TEST(Mesh, ConnectionsThatWouldPullAtNothingAreNotThere) {
  SheetDefinition sheet = flat_sheet(5, 5);
  sheet.textile = paper_textile(0);
  sheet.textile.damping = 0;
  auto found = counts(make_lattice(sheet));
  EXPECT_EQ(found.count(FamilyKind::kBend), 0u);
  EXPECT_EQ(found.count(FamilyKind::kDiagonalBend), 0u);
  EXPECT_GT(found[FamilyKind::kStretch], 0u);
}

TEST(Mesh, PlacementTurnsTheLatticeAboutItsFirstParticle) {
  SheetDefinition sheet = flat_sheet(3, 4, 0.1);
  sheet.origin = {1, 2, 3};
  sheet.rotation = Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitX()));
  const Matrix3Xd x = start_positions(sheet);
  EXPECT_LT((x.col(0) - Vector3d(1, 2, 3)).norm(), 1e-15);
  EXPECT_LT((x.col(3) - Vector3d(1.3, 2, 3)).norm(), 1e-12);
  EXPECT_LT((x.col(8) - Vector3d(1, 1.8, 3)).norm(), 1e-12);
}

}  // namespace
}  // namespace weft::testing

#include "core/triangles/folds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/forces/elastic.h"
#include "core/forces/hinges.h"
#include "core/model/mesh_problems.h"
#include "core/simulation.h"
#include "core/triangles/triangles.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/triangle_meshes.h"

namespace weft::testing {
namespace {

using std::numbers::pi;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr double kFoldHalf = 0.06, kFoldSpacing = 0.01;  // m
constexpr BendStiffness kFoldBend{4e-6, 1e-6, 2.5e-6};

// A square in the plane y = 0, u along x, folded along the line in its middle that runs along z.
TriangleMesh folded_square(double angle, double turn = 0) {
  TriangleMesh mesh = triangle_mesh(square(Cut::kRight, 2 * kFoldHalf, kFoldSpacing));
  std::vector<std::pair<double, int>> middle;
  const Triangles whole = complete(mesh);
  for (std::size_t i = 0; i < whole->start.size(); ++i)
    if (std::abs(whole->start[i].x() - kFoldHalf) < 1e-9)
      middle.emplace_back(whole->start[i].z(), static_cast<int>(i));
  std::sort(middle.begin(), middle.end());
  Fold& fold = mesh.folds.emplace_back();
  for (const auto& [z, i] : middle) fold.particles.push_back(i);
  fold.angle = angle;
  if (turn != 0) mesh.panels = {{"turned", static_cast<int>(mesh.triangles.size()), turn}};
  return mesh;
}

// The square's second half turned about the line by that angle, to the side of its normals.
Matrix3Xd roof(const TriangleMesh& mesh, double angle) {
  const Triangles whole = complete(mesh);
  const auto& [a, b, c] = whole->triangles[0];
  const Vector3d normal =
      (whole->start[static_cast<std::size_t>(b)] - whole->start[static_cast<std::size_t>(a)])
          .cross(whole->start[static_cast<std::size_t>(c)] -
                 whole->start[static_cast<std::size_t>(a)]);
  Matrix3Xd x(3, static_cast<Eigen::Index>(whole->start.size()));
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const Vector3d& start = whole->start[static_cast<std::size_t>(i)];
    const double beyond = std::max(0.0, start.x() - kFoldHalf);
    x.col(i) << start.x() - beyond + beyond * std::cos(angle),
        std::copysign(beyond * std::sin(angle), normal.y() * std::sin(angle)), start.z();
  }
  return x;
}

Surface surface_of_fold(const TriangleMesh& mesh) {
  const RestShape shape = rest_shape(*complete(mesh));
  return {.fits = fit_curvature(shape, mesh.folds),
          .hinges = make_hinges(shape, mesh.folds, {kFoldBend}),
          .bend = {kFoldBend}};
}

SheetDefinition pressed(const TriangleMesh& mesh) {
  SheetDefinition sheet;
  sheet.name = "cloth";
  sheet.shape = complete(mesh);
  sheet.textile = {light_textile(0.2), 1e-3, 0.3};
  sheet.bending = Isometric{};
  return sheet;
}

double angle_at_fold(const TriangleMesh& mesh, const Matrix3Xd& x) {
  double sum = 0;
  const std::vector<Hinge> hinges = surface_of_fold(mesh).hinges;
  for (const Hinge& hinge : hinges) sum += angle_of(hinge, x);
  return sum / static_cast<double>(hinges.size());
}

TEST(Folds, ASheetFoldedAsItIsPressedHasNoEnergyAndNoForces) {
  for (const double angle : {-3.0, -pi / 2, -0.2, 0.4, pi / 2, 3.0}) {
    const TriangleMesh mesh = folded_square(angle);
    Mesh of = make_triangles(pressed(mesh));
    const Matrix3Xd x = roof(mesh, angle);
    EXPECT_NEAR(elastic_energy(of, x), 0, 1e-15) << angle;
    EXPECT_NEAR(angle_at_fold(mesh, x), angle, 1e-12);
    Matrix3Xd force = Matrix3Xd::Zero(3, x.cols());
    add_elastic_forces(of, x, Matrix3Xd::Zero(3, x.cols()), force);
    EXPECT_LT(force.cwiseAbs().maxCoeff(), 1e-10) << angle;
    EXPECT_GT(elastic_energy(of, roof(mesh, -angle)), 1e-7) << "to the other side";
  }
}

// B / 2 (kappa - angle / w)^2 over a strip of width w: for a sheet that is held flat
// B angle^2 / (2 w) for each metre, of which B is that of bending about the line.
TEST(Folds, HeldFlatTheyStoreTheEnergyOfAStripThatIsCurvedAtRest) {
  constexpr double kAngle = 0.02;
  for (const double turn : {0.0, pi / 2, pi / 6}) {
    const TriangleMesh mesh = folded_square(kAngle, turn);
    const double c = std::cos(turn), s = std::sin(turn);
    const double rigidity = kFoldBend.warp * c * c * c * c + kFoldBend.weft * s * s * s * s +
                            2 * kFoldBend.twist * c * c * s * s;
    const double expected = rigidity * kAngle * kAngle / (2 * kFoldWidth) * 2 * kFoldHalf;
    EXPECT_NEAR(hinge_energy(surface_of_fold(mesh).hinges, roof(mesh, 0)), expected,
                1e-4 * expected)
        << turn;
  }
}

TEST(Folds, ForcesAreTheGradientOfTheEnergyAndKeepMomentum) {
  const TriangleMesh mesh = folded_square(2.5);
  const std::vector<Hinge> hinges = surface_of_fold(mesh).hinges;
  const Matrix3Xd x = roof(mesh, 0.7) + 1e-3 * noise(static_cast<int>(mesh.flat.size()));
  Matrix3Xd force = Matrix3Xd::Zero(3, x.cols());
  add_hinge_forces(hinges, x, force);
  const double largest = force.cwiseAbs().maxCoeff();
  ASSERT_GT(largest, 1e-5);
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    constexpr double kStep = 1e-7;
    Matrix3Xd ahead = x, behind = x;
    ahead(i) += kStep;
    behind(i) -= kStep;
    const double gradient =
        (hinge_energy(hinges, behind) - hinge_energy(hinges, ahead)) / (2 * kStep);
    EXPECT_NEAR(force(i), gradient, 1e-5 * largest) << i;
  }
  Vector3d torque = Vector3d::Zero();
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    torque += Vector3d(x.col(i)).cross(Vector3d(force.col(i)));
  EXPECT_LT(force.rowwise().sum().norm(), 1e-12 * largest);
  EXPECT_LT(torque.norm(), 1e-12 * largest);
}

TEST(Folds, AFreeSheetComesToRestAtTheAngle) {
  for (const double angle : {-2.6, -pi / 2, 0.5, 2.6}) {
    const TriangleMesh mesh = folded_square(angle);
    SheetDefinition sheet = pressed(mesh);
    std::get<MeasuredTextile>(sheet.textile.model).air_drag = 2;
    Simulation simulation(floating(sheet));
    for (int frame = 0; frame < 240; ++frame) ASSERT_TRUE(simulation.advance_frame());
    EXPECT_THAT(simulation.repairs(), SizeIs(0));
    EXPECT_NEAR(angle_at_fold(mesh, positions(simulation)), angle, 0.02);
    EXPECT_LT(simulation.deformation().largest_strain, 1e-3);
  }
}

TEST(Folds, StiffOnesKeepToThePlannedStep) {
  const TriangleMesh mesh = folded_square(3.0);
  SheetDefinition sheet = pressed(mesh);
  auto& textile = std::get<MeasuredTextile>(sheet.textile.model);
  textile.bend_rigidity_warp = textile.bend_rigidity_weft = 1e-3;
  Scene scene = floating(sheet);
  Simulation from_flat(scene);
  for (int frame = 0; frame < 60; ++frame) ASSERT_TRUE(from_flat.advance_frame());
  EXPECT_THAT(from_flat.repairs(), SizeIs(0));
  scene.sheets[0].start_positions = values(roof(mesh, 3.0));
  EXPECT_GT(measured_step(make_triangles(sheet), roof(mesh, 3.0)),
            Simulation(scene).plan().step.linear_bound);
}

TEST(Folds, NoneReachesAcrossOne) {
  const TriangleMesh mesh = folded_square(1);
  const Triangles whole = complete(mesh);
  for (const CurvatureFit& fit : surface_of_fold(mesh).fits) {
    double least = 0, most = 0;
    for (const int i : fit.particle) {
      const double beyond = whole->start[static_cast<std::size_t>(i)].x() - kFoldHalf;
      least = std::min(least, beyond);
      most = std::max(most, beyond);
    }
    EXPECT_TRUE(least > -1e-9 || most < 1e-9) << least << " to " << most;
  }
}

TEST(Folds, WhatIsNoLineInsideTheSheetIsToldOf) {
  Scene scene = floating(pressed(folded_square(1)));
  const auto problems_with = [&](const Fold& fold) {
    TriangleMesh mesh = folded_square(1);
    mesh.folds.push_back(fold);
    return find_problems(*complete(mesh), "mesh");
  };
  const Fold good = folded_square(1).folds[0];
  EXPECT_THAT(find_problems(*complete(folded_square(1)), "mesh"), SizeIs(0));
  const auto twice = problems_with({{good.particles[2], good.particles[1]}, 1});
  ASSERT_THAT(twice, SizeIs(1));
  EXPECT_EQ(twice[0].field, "mesh.folds[1].particles");
  EXPECT_THAT(twice[0].message, HasSubstr("is folded already, by folds[0]"));
  const auto apart = problems_with({{0, static_cast<int>(folded_square(1).flat.size()) + 7}, 4});
  ASSERT_THAT(apart, SizeIs(2));
  EXPECT_EQ(apart[0].field, "mesh.folds[1].angle_rad");
  EXPECT_THAT(apart[1].message, HasSubstr("are not the ends of an edge"));
  scene.sheets[0].bending = ChoiKo{};
  const auto law = find_problems(scene);
  ASSERT_THAT(law, SizeIs(1));
  EXPECT_EQ(law[0].field, "sheets[0].triangles.data.folds");
}

}  // namespace
}  // namespace weft::testing

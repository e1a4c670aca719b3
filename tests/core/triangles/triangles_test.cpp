#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "core/forces/curvature.h"
#include "core/forces/membrane.h"
#include "core/motion/sheet_solver.h"
#include "core/triangles/fit.h"
#include "core/triangles/rest_shape.h"
#include "tests/support/core/reference_case.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/triangle_meshes.h"

namespace weft::testing {
namespace {

constexpr MembraneStiffness kMembrane{80, 50, 8, 30};
constexpr BendStiffness kBend{2e-6, 1e-6, 1.5e-6};

Surface membrane_of(const RestShape& shape) {
  return {.membrane = make_membrane(shape), .stretch = {kMembrane}};
}
Surface bending_of(const RestShape& shape, const BendStiffness& stiffness) {
  return {.fits = fit_curvature(shape), .bend = {stiffness}};
}

class OnEveryMesh : public ::testing::TestWithParam<Cut> {
 protected:
  // The sheet, flat, then bent and stretched without order.
  static Matrix3Xd flat(const RestShape& shape) {
    Matrix3Xd x(3, shape.particles);
    const auto points = points_of(shape);
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
      const Vector2d& point = points[static_cast<std::size_t>(i)];
      x.col(i) << point.x(), 0, point.y();
    }
    return x;
  }
  static Matrix3Xd rough(const RestShape& shape) {
    return flat(shape) + 3e-3 * noise(shape.particles);
  }
};

INSTANTIATE_TEST_SUITE_P(Triangles, OnEveryMesh,
                         ::testing::Values(Cut::kRight, Cut::kAlternating, Cut::kEquilateral,
                                           Cut::kIrregular));

// The negative gradient, by central differences.
template <class Energy>
Matrix3Xd gradient_force(const Matrix3Xd& x, double step, const Energy& energy) {
  Matrix3Xd force(3, x.cols());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    Matrix3Xd ahead = x, behind = x;
    ahead(i) += step;
    behind(i) -= step;
    force(i) = (energy(behind) - energy(ahead)) / (2 * step);
  }
  return force;
}

TEST_P(OnEveryMesh, ForcesAreTheGradientOfTheEnergy) {
  const RestShape shape = square(GetParam(), 0.2, 0.04);
  const Matrix3Xd x = rough(shape);
  const Surface stretched = membrane_of(shape), bent = bending_of(shape, kBend);
  Matrix3Xd membrane = Matrix3Xd::Zero(3, x.cols()), bend = membrane;
  add_membrane_forces(stretched, x, membrane);
  add_curvature_forces(bent, x, bend);
  const auto membrane_at = [&](const Matrix3Xd& at) { return membrane_energy(stretched, at); };
  const auto bend_at = [&](const Matrix3Xd& at) { return curvature_energy(bent, at); };
  EXPECT_LT((membrane - gradient_force(x, 1e-6, membrane_at)).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_LT((bend - gradient_force(x, 1e-4, bend_at)).cwiseAbs().maxCoeff(),
            1e-9 * bend.cwiseAbs().maxCoeff() + 1e-12);
}

TEST_P(OnEveryMesh, ForcesKeepMomentumAndAngularMomentum) {
  const RestShape shape = square(GetParam(), 0.2, 0.04);
  const Matrix3Xd x = rough(shape);
  Matrix3Xd force = Matrix3Xd::Zero(3, x.cols());
  add_membrane_forces(membrane_of(shape), x, force);
  add_curvature_forces(bending_of(shape, kBend), x, force);
  Vector3d torque = Vector3d::Zero();
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    torque += Vector3d(x.col(i)).cross(Vector3d(force.col(i)));
  const double largest = force.cwiseAbs().maxCoeff();
  EXPECT_GT(largest, 1e-3);
  EXPECT_LT(force.rowwise().sum().norm(), 1e-12 * largest * static_cast<double>(x.cols()));
  EXPECT_LT(torque.norm(), 1e-12 * largest * static_cast<double>(x.cols()));
}

// W / A = E_u e^2 / 2 for a stretch along the warp by s, e = s + s^2 / 2, and G g^2 / 2
TEST_P(OnEveryMesh, AStretchedOrShearedSheetStoresTheEnergyOfItsStiffness) {
  const RestShape shape = square(GetParam(), 0.2, 0.04);
  const Surface surface = membrane_of(shape);
  const double whole = areas(shape).sum();
  const double s = 0.02, e = s + s * s / 2;
  Matrix3Xd warp = flat(shape), weft = warp, sheared = warp;
  warp.row(0) *= 1 + s;
  weft.row(2) *= 1 + s;
  sheared.row(1) += s * sheared.row(2);  // out of its plane, for more than one component
  sheared.row(0) += s * sheared.row(2);
  EXPECT_NEAR(membrane_energy(surface, warp), whole * kMembrane.warp * e * e / 2, 1e-12);
  EXPECT_NEAR(membrane_energy(surface, weft), whole * kMembrane.weft * e * e / 2, 1e-12);
  const double stretched = s * s;  // (V.V - 1) / 2 with V = (s, s, 1)
  EXPECT_NEAR(membrane_energy(surface, sheared),
              whole * (kMembrane.shear * s * s + kMembrane.weft * stretched * stretched) / 2,
              1e-12);
  EXPECT_NEAR(strain_of(threads_of(surface.membrane[0], warp)).warp, e, 1e-12);
}

// B / 2 kappa^2 on a cylinder of radius 1 m, whose axis lies at any angle to the threads
TEST_P(OnEveryMesh, ACylinderStoresTheEnergyOfTheRigidityInEveryDirection) {
  const RestShape shape = square(GetParam(), 0.4, 0.04);
  const Surface even = bending_of(shape, {1, 1, 1}), uneven = bending_of(shape, kBend);
  const double whole = areas(shape).sum();
  const auto points = points_of(shape);
  for (const int degrees : {0, 30, 45, 90}) {
    const double c = std::cos(degrees * std::numbers::pi / 180);
    const double s = std::sin(degrees * std::numbers::pi / 180);
    Matrix3Xd x(3, shape.particles);
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
      const Vector2d& point = points[static_cast<std::size_t>(i)];
      const double along = c * point.x() + s * point.y();
      x.col(i) << std::sin(along), -std::cos(along), c * point.y() - s * point.x();
    }
    EXPECT_NEAR(curvature_energy(even, x) / (whole / 2), 1, 0.002) << degrees;
    // orthotropic: B_u c^4 + B_v s^4 + 2 B_t c^2 s^2
    const double rigidity =
        kBend.warp * std::pow(c, 4) + kBend.weft * std::pow(s, 4) + 2 * kBend.twist * c * c * s * s;
    EXPECT_NEAR(curvature_energy(uneven, x) / (whole / 2) / rigidity, 1, 0.002) << degrees;
  }
}

// A strip under an even moment: it is the ends that bend it, so nothing pulls at particles away
// from them, those along its free sides among them.
TEST_P(OnEveryMesh, AnEvenMomentIsHeldByTheEndsAlone) {
  constexpr double kSpacing = 0.02, kCurvature = 2;
  const RestShape shape = cut_rectangle(GetParam(), 0.3, 0.1, kSpacing);
  const Surface surface = bending_of(shape, kBend);
  Matrix3Xd x = flat(shape);
  x.row(1) = kCurvature / 2 * x.row(0).array().square();
  Matrix3Xd force = Matrix3Xd::Zero(3, x.cols());
  add_curvature_forces(surface, x, force);
  const double usual = kBend.warp * kCurvature;  // B kappa h^2 / h^2, N
  double most = 0, at_ends = 0;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const bool inside = x(0, i) > 4 * kSpacing && x(0, i) < 0.3 - 4 * kSpacing;
    double& largest = inside ? most : at_ends;
    largest = std::max(largest, std::abs(force(1, i)));
  }
  EXPECT_LT(most, 0.06 * usual);
  EXPECT_GT(at_ends, 0.1 * usual);
}

TEST_P(OnEveryMesh, NoTriangleIsASliver) {
  for (const double spacing : {0.04, 0.01})
    for (const RestShape& shape :
         {cut_rectangle(GetParam(), 0.4, 0.3, spacing), cut_disc(GetParam(), 0.15, spacing)})
      for (const MembraneElement& element : make_membrane(shape))
        for (std::size_t k = 0; k < 3; ++k) {
          EXPECT_GT(element.area, 0);
          EXPECT_GT(1 / std::hypot(element.du[k], element.dv[k]), 0.2 * spacing);
        }
}

TEST_P(OnEveryMesh, AFlatSheetResistsNoTurnStretchOrShearByBending) {
  const RestShape shape = square(GetParam(), 0.2, 0.04);
  Eigen::Matrix3d any;
  any << 1.1, 0.2, -0.3, 0.4, 0.9, 0.1, -0.2, 0.3, 1.3;
  const Matrix3Xd x = any * flat(shape);
  EXPECT_LT(curvature_energy(bending_of(shape, {1, 1, 1}), x), 1e-20);
}

TEST(Triangles, AParticleHasAThirdOfTheAreaAroundIt) {
  const RestShape shape = square(Cut::kRight, 0.2, 0.1);
  const VectorXd area = areas(shape);
  EXPECT_NEAR(area.sum(), 0.04, 1e-15);
  EXPECT_NEAR(area[4], 0.01, 1e-15) << "the middle has six triangles of 0.005";
  const auto lies = border(shape);
  EXPECT_EQ(std::count(lies.begin(), lies.end(), true), 8);
  EXPECT_EQ(edges(shape).size(), 16U);
}

// An independent solution (DOP853, rtol 1e-10) of the same membrane, with damping along edges.
struct MeshCase {
  explicit MeshCase(const std::string& name) {
    std::ifstream file(std::string(WEFT_TEST_DATA_DIR) + "/reference/" + name + ".json");
    const auto data = nlohmann::json::parse(file);
    std::vector<Vector2d> points;
    for (const auto& point : data["rest_uv"]) points.emplace_back(point[0], point[1]);
    const RestShape shape = rest_shape(points, data["triangles"]);
    surface.membrane = make_membrane(shape);
    surface.stretch = {{data["E_u"], data["E_v"], data["E_uv"], data["G"]}};
    damping = data["k_damping"];
    pairs = edges(shape);
    const VectorXd mass = areas(shape) * data["areal_density"].get<double>();
    dynamics.inverse_mass = mass.cwiseInverse();
    for (const int pin : data["pins"]) dynamics.inverse_mass[pin] = 0;
    if (data["air_drag"] > 0) dynamics.drag = mass * data["air_drag"].get<double>();
    dynamics.gravity = Vector3d(data["gravity"][0], data["gravity"][1], data["gravity"][2]);
    dynamics.air = [](double) { return Vector3d(Vector3d::Zero()); };
    start.resize(3, shape.particles);
    for (Eigen::Index i = 0; i < start.cols(); ++i)
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        start(axis, i) =
            data["start_positions"][static_cast<std::size_t>(i)][static_cast<std::size_t>(axis)];
    rows = load_csv("reference/" + name + ".csv");
  }

  // Largest of the root mean squares of the distances at the times given, m.
  double error(double dt) {
    dynamics.force = [this](double, const Matrix3Xd& x, const Matrix3Xd& v, Matrix3Xd& force) {
      force.setZero(3, x.cols());
      add_membrane_forces(surface, x, force);
      for (const auto& [i, j] : pairs) {
        const Vector3d pull = damping * (v.col(j) - v.col(i));
        force.col(i) += pull;
        force.col(j) -= pull;
      }
    };
    const auto solver = make_plain_solver(dynamics, IntegratorKind::kVerlet);
    solver->start(start, Matrix3Xd::Zero(3, start.cols()), 0, dt);
    double worst = 0;
    std::int64_t step = 0;
    for (const auto& row : rows) {
      for (; step < std::llround(row[0] / dt); ++step)
        solver->advance(static_cast<double>(step) * dt, 1, calling_thread());
      Matrix3Xd x;
      solver->positions(x);
      const Eigen::Map<const Matrix3Xd> truth(row.data() + 1, 3, start.cols());
      worst = std::sqrt((x - truth).colwise().squaredNorm().mean());
    }
    return worst;
  }

  Surface surface;
  double damping = 0;
  std::vector<Connection> pairs;
  Dynamics dynamics;
  Matrix3Xd start;
  std::vector<std::vector<double>> rows;
};

class MeshReference : public ::testing::TestWithParam<std::pair<const char*, double>> {};

TEST_P(MeshReference, TrajectoriesAreMetInSecondOrder) {
  MeshCase given(GetParam().first);
  const double error = given.error(2.5e-5), halved = given.error(1.25e-5);
  RecordProperty("rms_m", std::to_string(error * 1e9) + " nm");
  EXPECT_LT(error, GetParam().second);
  EXPECT_NEAR(error / halved, 4, 0.2);
}

INSTANTIATE_TEST_SUITE_P(, MeshReference,
                         ::testing::Values(std::pair("mesh_swing", 1e-7),
                                           std::pair("mesh_pulled", 1e-5)));

}  // namespace
}  // namespace weft::testing

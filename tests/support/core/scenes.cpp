#include "tests/support/core/scenes.h"

#include <bit>
#include <limits>
#include <random>

namespace weft::testing {

Textile paper_textile(double bend) {
  return {RawTextile{.particle_mass = 1e-3, .stretch = 2000, .shear = 2000, .bend = bend}, 2e-4,
          0.3};
}

MeasuredTextile light_textile(double areal_density) {
  return {.areal_density = areal_density,
          .tensile_warp = 200,
          .tensile_weft = 200,
          .shear = 20,
          .bend_rigidity_warp = 1e-5,
          .bend_rigidity_weft = 1e-5};
}

SheetDefinition flat_sheet(int rows, int columns, double spacing) {
  SheetDefinition sheet;
  sheet.name = "sheet";
  sheet.shape = Grid{rows, columns, spacing};
  sheet.textile = paper_textile();
  return sheet;
}

Scene floating(const SheetDefinition& sheet) {
  Scene scene;
  scene.solver.precision = Precision::kDouble;
  scene.sheets = {sheet};
  scene.environment.gravity.setZero();
  scene.solver.frame_step = 0.01;
  return scene;
}

Matrix3Xd noise(int particles, unsigned seed) {
  std::mt19937_64 random(seed);
  Matrix3Xd out(3, particles);
  for (double& value : out.reshaped()) value = static_cast<double>(random()) * 0x1p-63 - 1;
  return out;
}

namespace {

Matrix3Xd from_planes(const std::vector<double>& planes) {
  const auto n = static_cast<Eigen::Index>(planes.size() / 3);
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3>>(planes.data(), n, 3)
      .transpose();
}

}  // namespace

std::uint64_t hash_of(const Matrix3Xd& values) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const double value : values.reshaped()) {
    hash ^= std::bit_cast<std::uint64_t>(value);
    hash *= 0x100000001b3u;
  }
  return hash;
}

Matrix3Xd positions(const Simulation& simulation) {
  std::vector<double> planes(3 * static_cast<std::size_t>(simulation.particle_count()));
  simulation.copy_positions(planes);
  return from_planes(planes);
}

Matrix3Xd velocities(const Simulation& simulation) {
  std::vector<double> planes(3 * static_cast<std::size_t>(simulation.particle_count()));
  simulation.copy_velocities(planes);
  return from_planes(planes);
}

std::vector<double> values(const Matrix3Xd& columns) {
  return {columns.data(), columns.data() + columns.size()};
}

Matrix3Xd stretched(const SheetDefinition& sheet, double strain) {
  return start_positions(sheet) * (1 + strain);
}

double slide_on(const Collider& incline, const Quaterniond& turn, const Vector3d& start,
                double seconds) {
  SheetDefinition sheet = flat_sheet(2, 2, 0.01);
  sheet.textile = {RawTextile{.particle_mass = 1e-3}, 0, incline.friction};
  sheet.rotation = turn;
  sheet.skin = 1e-3;
  sheet.origin = turn * start;
  Scene scene = floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  scene.colliders = {incline};
  scene.solver.substep = 1e-4;
  scene.solver.frame_step = 0.01;
  Simulation simulation(scene);
  const Matrix3Xd from = positions(simulation);
  while (simulation.time() < seconds - 1e-9)
    if (!simulation.advance_frame()) return std::numeric_limits<double>::quiet_NaN();
  return (positions(simulation) - from).col(0).norm();
}

}  // namespace weft::testing

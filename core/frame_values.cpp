#include "core/frame_values.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/forces/elastic.h"
#include "core/model/self_weight.h"
#include "core/moving_sheet.h"

namespace weft {
namespace {

// Of each particle, m^2: a third of its triangles, of a grid a quarter of its cells.
VectorXd areas_of(const SheetShape& shape, const Matrix3Xd& x) {
  VectorXd areas = VectorXd::Zero(x.cols());
  if (const auto* grid = std::get_if<Grid>(&shape)) {
    for (int row = 0; row + 1 < grid->rows; ++row)
      for (int column = 0; column + 1 < grid->columns; ++column) {
        const int a = row * grid->columns + column, b = a + 1, c = a + grid->columns, d = c + 1;
        const Vector3d one = x.col(d) - x.col(a), other = x.col(c) - x.col(b);
        for (const int i : {a, b, c, d}) areas[i] += one.cross(other).norm() / 8;
      }
    return areas;
  }
  for (const auto& [a, b, c] : triangles_of(shape)) {
    const Vector3d ab = x.col(b) - x.col(a), ac = x.col(c) - x.col(a);
    const double third = ab.cross(ac).norm() / 6;
    for (const int i : {a, b, c}) areas[i] += third;
  }
  return areas;
}

using PositionPlanes = Eigen::Map<const Eigen::MatrixX3d>;

PositionPlanes planes_of(const std::vector<double>& positions) {
  return {positions.data(), static_cast<Eigen::Index>(positions.size() / 3), 3};
}

// A body between two poses, at a time of these.
BodyMesh mesh_at(const Collider& collider, double time) {
  const Poses& poses = *collider.poses;
  BodyMesh mesh{{}, std::get<SharedBody>(collider.shape)->mesh.triangles};
  const auto next = std::upper_bound(poses.times.begin(), poses.times.end(), time);
  const auto after = static_cast<std::size_t>(next - poses.times.begin());
  const std::size_t to = std::min(after, poses.times.size() - 1), from = after > 0 ? after - 1 : 0;
  const double share =
      to > from ? (time - poses.times[from]) / (poses.times[to] - poses.times[from]) : 0;
  for (std::size_t v = 0; v < poses.vertices(); ++v) {
    const Vector3d start = poses.position(from, v);
    mesh.vertices.emplace_back(start + share * (poses.position(to, v) - start));
  }
  return mesh;
}

}  // namespace

Distance distance_from_any(const Scene& scene, const MovingBodies& bodies, const Vector3d& x,
                           double time) {
  Distance least{std::numeric_limits<double>::infinity(), Vector3d::UnitY()};
  for (std::size_t c = 0; c < scene.colliders.size(); ++c)
    if (const Distance found = distance(scene.colliders[c], x, time, bodies.of(c));
        found.value < least.value)
      least = found;
  return least;
}

VectorXd pressures(const Scene& scene, const MovingBodies& bodies, const SheetDefinition& sheet,
                   const MovingSheet& moving, const Matrix3Xd& x, double time) {
  constexpr double kTouching = 0.1;  // of the skin
  const VectorXd areas = areas_of(sheet.shape, x);
  Matrix3Xd force = moving.dynamics.gravity * moving.mesh.mass.transpose();
  add_elastic_forces(moving.mesh, x, Matrix3Xd::Zero(3, x.cols()), force);
  VectorXd pressure = VectorXd::Zero(x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    if (moving.dynamics.inverse_mass[i] == 0 || areas[i] == 0) continue;
    const auto [value, normal] = distance_from_any(scene, bodies, x.col(i), time);
    if (value + moving.dressing.deflate < (1 + kTouching) * moving.skin)
      pressure[i] = std::max(0.0, -force.col(i).dot(normal)) / areas[i];
  }
  return pressure;
}

void add(const MovingSheet& sheet, const Matrix3Xd& x, Deformation& deformation) {
  deformation.potential_energy +=
      elastic_energy(sheet.mesh, x) - sheet.mesh.mass.dot(x.transpose() * sheet.dynamics.gravity);
  deformation.largest_strain = std::max(deformation.largest_strain, largest_strain(sheet.mesh, x));
}

FrameMeter::FrameMeter(const Scene& scene)
    : bodies_(scene.colliders), surfaces_(scene.colliders.size()) {}
FrameMeter::~FrameMeter() = default;

// Has the sheets as they are in the frame at `time`.
void FrameMeter::take(const std::shared_ptr<const Scene>& scene, double time) {
  const DressingState dressing =
      scene->dressing ? dressing_at(*scene->dressing, time) : DressingState();
  if (scene_ == scene) {
    if (dressing == sheets_.front().dressing) return;
    for (std::size_t s = 0; s < sheets_.size(); ++s)
      sheets_[s].dress(*scene, definitions_[s], dressing);
    return;
  }
  ++made_;
  sheets_.clear();
  definitions_.clear();
  for (std::size_t s = 0; s < scene->sheets.size(); ++s) definitions_.push_back(capped(*scene, s));
  for (const SheetDefinition& definition : definitions_) {
    MovingSheet& sheet = sheets_.emplace_back(definition);
    sheet.dressing = dressing;
    sheet.remake_mesh(*scene, definition);
  }
  scene_ = scene;
}

template <class F>
void FrameMeter::for_each_sheet(const std::vector<double>& positions, const F& f) const {
  const PositionPlanes all = planes_of(positions);
  Eigen::Index first = 0;
  for (std::size_t s = 0; s < sheets_.size(); ++s) {
    const Matrix3Xd x = all.middleRows(first, definitions_[s].particle_count()).transpose();
    f(s, x);
    first += x.cols();
  }
}

Deformation FrameMeter::deformation(const std::shared_ptr<const Scene>& scene,
                                    const std::vector<double>& positions, double time) {
  const std::lock_guard lock(mutex_);
  take(scene, time);
  Deformation all;
  for_each_sheet(positions,
                 [&](std::size_t s, const Matrix3Xd& x) { weft::add(sheets_[s], x, all); });
  return all;
}

std::vector<double> FrameMeter::pressures(const std::shared_ptr<const Scene>& scene,
                                          const std::vector<double>& positions, double time) {
  const std::lock_guard lock(mutex_);
  take(scene, time);
  bodies_.place(scene->colliders, time, 0);
  std::vector<double> values;
  for_each_sheet(positions, [&](std::size_t s, const Matrix3Xd& x) {
    const VectorXd found = weft::pressures(*scene, bodies_, definitions_[s], sheets_[s], x, time);
    values.insert(values.end(), found.begin(), found.end());
  });
  return values;
}

std::vector<double> FrameMeter::clearances(const std::shared_ptr<const Scene>& scene,
                                           const std::vector<double>& positions, double time) {
  const std::lock_guard lock(mutex_);
  bodies_.place(scene->colliders, time, 0);
  const double deflate = scene->dressing ? dressing_at(*scene->dressing, time).deflate : 0;
  const PositionPlanes all = planes_of(positions);
  std::vector<double> values(static_cast<std::size_t>(all.rows()));
  for (Surface& surface : surfaces_) surface.nearest.resize(values.size(), -1);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] =
        clearance(*scene, all.row(static_cast<Eigen::Index>(i)).transpose(), time, i) + deflate;
  return values;
}

double FrameMeter::clearance(const Scene& scene, const Vector3d& x, double time,
                             std::size_t particle) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < scene.colliders.size(); ++c) {
    const Collider& collider = scene.colliders[c];
    double value = distance(collider, x, time, bodies_.of(c)).value;
    if (std::holds_alternative<SharedBody>(collider.shape)) {
      const Vector3d at = x - offset_at(collider.path, time);
      Surface& surface = surfaces_[c];
      // a guess makes it quick: where it was, or where its neighbour is
      int& nearest = surface.nearest[particle];
      if (nearest < 0) nearest = particle > 0 ? surface.nearest[particle - 1] : 0;
      const auto found = tree_of(collider, surface, pose_time(collider, time)).nearest(at, nearest);
      nearest = found.triangle;
      value = std::copysign(std::sqrt(found.squared), value);
    }
    least = std::min(least, value);
  }
  return least;
}

const TriangleTree& FrameMeter::tree_of(const Collider& collider, Surface& surface, double time) {
  if (surface.tree && (!collider.poses || surface.time == time)) return *surface.tree;
  ++made_;
  if (collider.poses) surface.mesh = mesh_at(collider, time);
  surface.time = time;
  surface.tree = std::make_unique<TriangleTree>(
      collider.poses ? surface.mesh : std::get<SharedBody>(collider.shape)->mesh);
  return *surface.tree;
}

void FrameMeter::release_memory() {
  const std::lock_guard lock(mutex_);
  scene_.reset();
  sheets_.clear();
  definitions_.clear();
  for (Surface& surface : surfaces_) surface = {};
  bodies_.release_memory();
}

int FrameMeter::made() const {
  const std::lock_guard lock(mutex_);
  return made_;
}

}  // namespace weft

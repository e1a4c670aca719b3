#include "core/moving_sheet.h"

#include <algorithm>
#include <utility>

#include "core/forces/air.h"
#include "core/forces/elastic.h"
#include "core/forces/springs.h"

namespace weft {

void MovingSheet::set_definition(const Scene& scene, const SheetDefinition& definition) {
  damping_in_motion.reset();
  Mesh made = make_mesh(definition);
  if (const auto& ratio = definition.textile.damping_ratio)
    made.damping = damping_of(definition, made, *ratio);
  else if (!definition.textile.damping)
    made.damping = std::max(kDefaultDamping, damping_of(definition, made, kSafeDampingRatio));
  set_mesh(scene, definition, std::move(made));
}

void MovingSheet::set_mesh(const Scene& scene, const SheetDefinition& definition, Mesh made) {
  mesh = std::move(made);
  flat_ = {};
  if (dressing.ease < 1) {
    flat_ = mesh.surface;
    ease_rest_shape(definition, dressing.ease, mesh);
  }
  if (scene.environment.wind)
    dynamics.density = mesh.mass.sum() / area_of(definition);
  else
    mesh.triangles = std::vector<std::array<int, 3>>();
  skin = definition.skin_or_default();
  set_pins(definition);
  set_air_and_weight(scene);
}

void MovingSheet::set_air_and_weight(const Scene& scene) {
  dynamics.drag = mesh.drag;
  if (dressing.drag > 0) {
    if (dynamics.drag.size() == 0) dynamics.drag = VectorXd::Zero(mesh.mass.size());
    dynamics.drag += dressing.drag * mesh.mass;
  }
  dynamics.gravity = dressing.weight * scene.environment.gravity;
}

void MovingSheet::remake_mesh(const Scene& scene, const SheetDefinition& definition) {
  Mesh made = make_mesh(definition);
  made.damping = mesh.damping;
  set_mesh(scene, definition, std::move(made));
}

void MovingSheet::dress(const Scene& scene, const SheetDefinition& definition,
                        const DressingState& state) {
  const bool keeps_shape = state.ease == dressing.ease;
  dressing = state;
  if (!keeps_shape && flat_.membrane.empty()) return remake_mesh(scene, definition);
  if (!keeps_shape && state.ease < 1) {
    mesh.surface = flat_;
    ease_rest_shape(definition, state.ease, mesh);
  } else if (!keeps_shape) {
    mesh.surface = std::exchange(flat_, {});
  }
  set_air_and_weight(scene);
}

void MovingSheet::release_memory() {
  good_ = {};
  const double damping = mesh.damping;
  mesh = {};
  flat_ = {};
  mesh.damping = damping;
  dynamics.inverse_mass = dynamics.drag = VectorXd();
  dynamics.tethers = {};
  solver->release_memory();
}

void MovingSheet::restore_memory(const Scene& scene, const SheetDefinition& definition) {
  remake_mesh(scene, definition);
  solver->restore_memory();
}

void MovingSheet::set_pins(const SheetDefinition& definition) {
  dynamics.inverse_mass = mesh.mass.cwiseInverse();
  for (const Pin& pin : definition.pins)
    for (const int i : pin.particles) dynamics.inverse_mass[i] = 0;
  dynamics.tethers = make_tethers(definition);
}

void MovingSheet::bind_forces(const Scene& scene) {
  dynamics.force = [this](double /*time*/, const Matrix3Xd& x, const Matrix3Xd& v,
                          Matrix3Xd& force) {
    force.setZero(3, x.cols());
    add_fast_forces(mesh, x, v, force);
  };
  dynamics.slow_force = [&scene, this](double time, double give, const Matrix3Xd& x,
                                       const Matrix3Xd& v, Matrix3Xd& force) {
    if (!mesh.stencils.empty()) add_isometric_forces(mesh, x, force);
    if (scene.environment.wind)
      add_wind_forces(*scene.environment.wind, mesh, time, give, x, v, force);
  };
  dynamics.air = [&scene](double time) {
    return scene.environment.wind ? air_velocity(*scene.environment.wind, time)
                                  : Vector3d(Vector3d::Zero());
  };
}

double height_of(const SheetDefinition& sheet) {
  const auto [warp, weft] = extent(sheet.shape);
  return std::max(warp, weft) * sheet.spacing();
}

double end_of_motion(const Scene& scene) {
  double end = scene.dressing ? scene.dressing->end() : 0;
  const auto include = [&](const Path& path) {
    if (!path.empty()) end = std::max(end, path.back().time);
  };
  for (const SheetDefinition& sheet : scene.sheets)
    for (const Pin& pin : sheet.pins) include(pin.path);
  for (const Collider& collider : scene.colliders) {
    include(collider.path);
    if (collider.lead)
      end = std::max(end, collider.lead->end);
    else if (collider.poses)
      end = std::max(end, collider.poses->times.back());
  }
  return end;
}

void move_pins(const std::vector<Pin>& pins, double time, double dt, MovingSheet& sheet) {
  for (const Pin& pin : pins) {
    if (pin.path.empty()) continue;
    const Vector3d offset = offset_at(pin.path, time);
    const Vector3d displacement = offset - offset_at(pin.path, time - dt);
    for (const int i : pin.particles)
      sheet.solver->move_held(i, sheet.start(i) + offset, displacement);
  }
}

void hold_heights(const Scene& scene, double time, std::span<MovingSheet> sheets) {
  const Vector3d& gravity = scene.environment.gravity;
  const Vector3d up = gravity.isZero() ? Vector3d(Vector3d::UnitY()) : -gravity.normalized();
  for (const Hold& hold : scene.dressing->holds) {
    if (time > scene.dressing->close + hold.until) continue;
    MovingSheet& sheet = sheets[static_cast<std::size_t>(hold.sheet)];
    std::vector<int> particles;
    for (const int i : hold.particles)
      if (sheet.dynamics.inverse_mass[i] > 0) particles.push_back(i);
    const auto count = static_cast<Eigen::Index>(particles.size());
    if (count == 0) continue;
    Matrix3Xd x(3, count), d(3, count);
    sheet.solver->read(particles, x, d);
    for (Eigen::Index k = 0; k < count; ++k) {
      x.col(k) = (sheet.start(particles[static_cast<std::size_t>(k)]) - x.col(k)).dot(up) * up;
      d.col(k) = -d.col(k).dot(up) * up;
    }
    sheet.solver->displace(particles, x, d);
  }
}

void set_pin_velocities(const std::vector<Pin>& pins, double time, double dt, Matrix3Xd& v) {
  for (const Pin& pin : pins)
    for (const int i : pin.particles)
      v.col(i) = (offset_at(pin.path, time + dt) - offset_at(pin.path, time)) / dt;
}

}  // namespace weft

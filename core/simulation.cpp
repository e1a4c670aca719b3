#include "core/simulation.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/contact/contact.h"
#include "core/forces/air.h"
#include "core/forces/springs.h"
#include "core/motion/integrator.h"

namespace weft {
namespace {

// A sheet in motion.
struct Sheet {
  Mesh mesh;
  Motion motion;
  Dynamics dynamics;
  Matrix3Xd start;  // positions that paths are relative to, m
  double skin = 0;  // m
};

// Held particles go where their paths lead.
void lead_pins(const SheetDefinition& definition, double time, double dt, Sheet& sheet) {
  for (const Pin& pin : definition.pins) {
    if (pin.path.empty()) continue;
    const Vector3d offset = offset_at(pin.path, time);
    const Vector3d displacement = offset - offset_at(pin.path, time - dt);
    for (const int i : pin.particles) {
      sheet.motion.x.col(i) = sheet.start.col(i) + offset;
      sheet.motion.d.col(i) = displacement;
    }
  }
}

void set_textile_of(const Scene& scene, const SheetDefinition& definition, Sheet& sheet) {
  sheet.mesh = make_lattice(definition);
  sheet.dynamics.inverse_mass = sheet.mesh.mass.cwiseInverse();
  for (const Pin& pin : definition.pins)
    for (const int i : pin.particles) sheet.dynamics.inverse_mass[i] = 0;
  sheet.dynamics.drag = sheet.mesh.drag.maxCoeff() > 0 ? sheet.mesh.drag : VectorXd();
  sheet.dynamics.gravity = scene.environment.gravity;
  sheet.skin = definition.skin.value_or(definition.grid.spacing / 10);
}

// When the last path ends, s.
double end_of_paths(const Scene& scene) {
  double end = 0;
  const auto include = [&](const Path& path) {
    if (!path.empty()) end = std::max(end, path.back().time);
  };
  for (const SheetDefinition& sheet : scene.sheets)
    for (const Pin& pin : sheet.pins) include(pin.path);
  for (const Collider& collider : scene.colliders) include(collider.path);
  return end;
}

}  // namespace

struct Simulation::State {
  Scene scene;
  Plan plan;
  std::vector<Sheet> sheets;
  std::unique_ptr<Integrator> integrator;
  std::int64_t frame = 0;
  int frames_at_rest = 0;
  double rest_after = 0;  // s

  explicit State(Scene given);
  void bind_forces();
  void step(double time, double dt);
  bool quiet() const;
  Plan plan_now() const;
  double time() const { return static_cast<double>(frame) * scene.solver.frame_step; }
};

// One substep, from `time` to `time` + dt.
void Simulation::State::step(double time, double dt) {
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    Sheet& sheet = sheets[s];
    const SheetDefinition& definition = scene.sheets[s];

    // motion: springs and air give forces (bind_forces), the integrator asks for them where it
    // needs them
    integrator->advance(sheet.dynamics, time, dt, sheet.motion);
    lead_pins(definition, time + dt, dt, sheet);

    // contact last, so that no particle ends a step inside a collider
    if (!scene.colliders.empty())
      resolve_contacts(scene.colliders, definition.textile.friction, sheet.skin, time + dt, dt,
                       sheet.dynamics.inverse_mass, sheet.motion.x, sheet.motion.d);
  }
}

// The forces of each sheet; what its mesh or the scene lacks is not there to be computed.
void Simulation::State::bind_forces() {
  for (Sheet& sheet : sheets) {
    sheet.dynamics.force = [this, &mesh = sheet.mesh](double time, const Matrix3Xd& x,
                                                      const Matrix3Xd& v, Matrix3Xd& force) {
      force.setZero(3, x.cols());
      add_spring_forces(mesh, x, v, force);
      if (!mesh.stencils.empty()) add_isometric_forces(mesh, x, force);
      if (scene.environment.wind) add_wind_forces(*scene.environment.wind, mesh, time, x, v, force);
    };
    sheet.dynamics.air = [this](double time) {
      return scene.environment.wind ? air_velocity(*scene.environment.wind, time)
                                    : Vector3d(Vector3d::Zero());
    };
  }
}

Simulation::State::State(Scene given)
    : scene(std::move(given)),
      sheets(scene.sheets.size()),
      integrator(make_integrator(scene.solver.integrator)),
      rest_after(end_of_paths(scene)) {
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const SheetDefinition& definition = scene.sheets[s];
    set_textile_of(scene, definition, sheets[s]);
    sheets[s].start = sheets[s].motion.x = start_positions(definition);
    for (const Pin& pin : definition.pins)
      for (const int i : pin.particles) sheets[s].motion.x.col(i) += offset_at(pin.path, 0);
  }
  bind_forces();
  plan = plan_now();

  const double dt = plan.step.substep;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const SheetDefinition& definition = scene.sheets[s];
    Matrix3Xd v = start_velocities(definition);
    for (const Pin& pin : definition.pins)
      for (const int i : pin.particles)
        v.col(i) = (offset_at(pin.path, dt) - offset_at(pin.path, 0)) / dt;
    integrator->start(sheets[s].dynamics, 0, dt, v, sheets[s].motion);
  }
}

Plan Simulation::State::plan_now() const {
  std::vector<SheetShape> shapes;
  shapes.reserve(sheets.size());
  for (const Sheet& sheet : sheets)
    shapes.push_back({sheet.mesh, sheet.dynamics.inverse_mass, sheet.motion.x});
  return make_plan(scene, shapes);
}

// Whether kinetic energy and net forces are small; the net force is m (d - d_previous) / dt^2,
// contact included.
bool Simulation::State::quiet() const {
  if (time() < rest_after) return false;
  constexpr double kEnergyShare = 1e-6, kForceShare = 0.01;
  const double dt = plan.step.substep;
  const double given = scene.environment.gravity.norm();
  const double gravity = given > 0 ? given : kStandardGravity;
  Matrix3Xd v;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const Sheet& sheet = sheets[s];
    const Grid& grid = scene.sheets[s].grid;
    const double height = (std::max(grid.rows, grid.columns) - 1) * grid.spacing;
    integrator->velocity(sheet.motion, dt, v);
    double energy = 0;
    for (Eigen::Index i = 0; i < v.cols(); ++i) {
      if (sheet.dynamics.inverse_mass[i] == 0) continue;
      energy += sheet.mesh.mass[i] / 2 * v.col(i).squaredNorm();
      const double a = (sheet.motion.d.col(i) - sheet.motion.d_previous.col(i)).norm() / (dt * dt);
      if (a > kForceShare * gravity) return false;
    }
    if (energy > kEnergyShare * sheet.mesh.mass.sum() * gravity * height) return false;
  }
  return true;
}

Simulation::Simulation(Scene scene) : state_(std::make_unique<State>(std::move(scene))) {}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

const Scene& Simulation::scene() const { return state_->scene; }
const Plan& Simulation::plan() const { return state_->plan; }
std::int64_t Simulation::frame() const { return state_->frame; }
double Simulation::time() const { return state_->time(); }

namespace {

std::optional<StepRefusal> refusal_of(const StepPlan& step, bool allow_unstable) {
  if (step.substep > step.linear_bound && !allow_unstable)
    return StepRefusal{step.substep, step.linear_bound, false};
  if (step.substeps > kMaxSubsteps) return StepRefusal{step.substep, step.linear_bound, true};
  return std::nullopt;
}

}  // namespace

std::optional<StepRefusal> Simulation::refusal() const {
  return refusal_of(state_->plan.step, state_->scene.solver.allow_unstable);
}

bool Simulation::advance_frame() {
  assert(!refusal());
  State& state = *state_;
  const StepPlan& step = state.plan.step;
  const double begin = state.time();
  for (std::int64_t k = 0; k < step.substeps; ++k)
    state.step(begin + static_cast<double>(k) * step.substep, step.substep);
  for (const Sheet& sheet : state.sheets)
    if (!sheet.motion.x.allFinite() || !sheet.motion.d.allFinite()) return false;
  ++state.frame;
  state.frames_at_rest = state.quiet() ? state.frames_at_rest + 1 : 0;
  return true;
}

bool Simulation::at_rest() const {
  constexpr int kFrames = 30;
  return state_->frames_at_rest >= kFrames;
}

int Simulation::particle_count() const {
  int count = 0;
  for (const SheetDefinition& sheet : state_->scene.sheets) count += sheet.particle_count();
  return count;
}

namespace {

// Writes the columns of a sheet into planes x, y, z of all sheets.
void copy_planes(const Matrix3Xd& from, Eigen::Index first, std::span<double> out) {
  const auto plane = static_cast<Eigen::Index>(out.size() / 3);
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    Eigen::Map<Eigen::RowVectorXd>(out.data() + axis * plane + first, from.cols()) = from.row(axis);
}

}  // namespace

void Simulation::copy_positions(std::span<double> out) const {
  Eigen::Index first = 0;
  for (const Sheet& sheet : state_->sheets) {
    copy_planes(sheet.motion.x, first, out);
    first += sheet.motion.x.cols();
  }
}

void Simulation::copy_velocities(std::span<double> out) const {
  Eigen::Index first = 0;
  Matrix3Xd v;
  for (const Sheet& sheet : state_->sheets) {
    state_->integrator->velocity(sheet.motion, state_->plan.step.substep, v);
    copy_planes(v, first, out);
    first += v.cols();
  }
}

FrameStats Simulation::stats() const {
  FrameStats stats;
  Matrix3Xd v;
  for (const Sheet& sheet : state_->sheets) {
    const Matrix3Xd& x = sheet.motion.x;
    state_->integrator->velocity(sheet.motion, state_->plan.step.substep, v);
    stats.kinetic_energy += sheet.mesh.mass.dot(v.colwise().squaredNorm().transpose()) / 2;
    stats.potential_energy += spring_energy(sheet.mesh, x) + isometric_energy(sheet.mesh, x) -
                              sheet.mesh.mass.dot(x.transpose() * sheet.dynamics.gravity);
    stats.largest_strain = std::max(stats.largest_strain, largest_strain(sheet.mesh, x));
  }
  return stats;
}

std::optional<StepRefusal> Simulation::set_textile(std::size_t index, const Textile& textile) {
  State& state = *state_;
  SheetDefinition& definition = state.scene.sheets[index];
  if (definition.textile == textile) return std::nullopt;

  const double dt = state.plan.step.substep;
  std::vector<Matrix3Xd> velocities(state.sheets.size());
  for (std::size_t s = 0; s < state.sheets.size(); ++s)
    state.integrator->closing_velocity(state.sheets[s].dynamics, state.time(), dt,
                                       state.sheets[s].motion, velocities[s]);

  const Textile old_textile = std::exchange(definition.textile, textile);
  set_textile_of(state.scene, definition, state.sheets[index]);
  Plan plan = state.plan_now();
  if (const auto refused = refusal_of(plan.step, state.scene.solver.allow_unstable)) {
    definition.textile = old_textile;
    set_textile_of(state.scene, definition, state.sheets[index]);
    return refused;
  }
  state.plan = std::move(plan);

  // sheets whose forces and step stay go on as they were
  const double new_dt = state.plan.step.substep;
  for (std::size_t s = 0; s < state.sheets.size(); ++s)
    if (s == index || new_dt != dt)
      state.integrator->start(state.sheets[s].dynamics, state.time(), new_dt, velocities[s],
                              state.sheets[s].motion);
  state.frames_at_rest = 0;
  return std::nullopt;
}

}  // namespace weft

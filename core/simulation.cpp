#include "core/simulation.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/contact/contact.h"
#include "core/forces/air.h"
#include "core/forces/springs.h"
#include "core/motion/sheet_solver.h"

namespace weft {
namespace {

// A sheet in motion.
struct Sheet {
  Mesh mesh;
  Dynamics dynamics;  // the forces in double
  std::unique_ptr<SheetSolver> solver;
  Matrix3Xd start;       // positions that paths are relative to, m
  Matrix3Xd velocities;  // of the frame before, m/s; empty at first
  double skin = 0;       // m
};

// Held particles go where their paths lead.
void lead_pins(const SheetDefinition& definition, double time, double dt, Sheet& sheet) {
  for (const Pin& pin : definition.pins) {
    if (pin.path.empty()) continue;
    const Vector3d offset = offset_at(pin.path, time);
    const Vector3d displacement = offset - offset_at(pin.path, time - dt);
    for (const int i : pin.particles) {
      sheet.solver->lead(i, sheet.start.col(i) + offset, displacement);
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

std::unique_ptr<SheetSolver> make_solver(const Scene& scene, const SheetDefinition& definition,
                                         const Dynamics& dynamics) {
  if (!needs_plain_solver(scene, definition).empty())
    return make_plain_solver(dynamics, scene.solver.integrator);
  return make_lattice_solver(definition, dynamics, scene.solver);
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
  std::int64_t frame = 0;
  int frames_at_rest = 0;
  std::int64_t substeps = 0;  // of the last frame
  double rest_after = 0;      // s

  explicit State(Scene given);
  void bind_forces();
  void step(double time, double dt);
  bool quiet();
  Plan plan_for(const std::vector<Matrix3Xd>& x) const;
  double time() const { return static_cast<double>(frame) * scene.solver.frame_step; }
};

// One substep, from `time` to `time` + dt.
void Simulation::State::step(double time, double dt) {
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    Sheet& sheet = sheets[s];
    const SheetDefinition& definition = scene.sheets[s];

    // forces and motion
    sheet.solver->advance(time);
    lead_pins(definition, time + dt, dt, sheet);

    // contact last, so that no particle ends a step inside a collider
    if (!scene.colliders.empty())
      sheet.solver->resolve(
          Contacts(scene.colliders, definition.textile.friction, sheet.skin, time + dt, dt));
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
    : scene(std::move(given)), sheets(scene.sheets.size()), rest_after(end_of_paths(scene)) {
  std::vector<Matrix3Xd> x(sheets.size());
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const SheetDefinition& definition = scene.sheets[s];
    set_textile_of(scene, definition, sheets[s]);
    sheets[s].start = x[s] = start_positions(definition);
    for (const Pin& pin : definition.pins)
      for (const int i : pin.particles) x[s].col(i) += offset_at(pin.path, 0);
  }
  bind_forces();
  plan = plan_for(x);

  const double dt = plan.step.substep;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const SheetDefinition& definition = scene.sheets[s];
    Matrix3Xd v = start_velocities(definition);
    for (const Pin& pin : definition.pins)
      for (const int i : pin.particles)
        v.col(i) = (offset_at(pin.path, dt) - offset_at(pin.path, 0)) / dt;
    sheets[s].solver = make_solver(scene, definition, sheets[s].dynamics);
    sheets[s].solver->start(x[s], v, 0, dt);
  }
}

// x: positions of each sheet.
Plan Simulation::State::plan_for(const std::vector<Matrix3Xd>& x) const {
  std::vector<SheetShape> shapes;
  shapes.reserve(sheets.size());
  for (std::size_t s = 0; s < sheets.size(); ++s)
    shapes.push_back({sheets[s].mesh, sheets[s].dynamics.inverse_mass, x[s]});
  return make_plan(scene, shapes);
}

// Whether in the last frame kinetic energy and mean net forces, contact included, were small. Net
// forces of one step would be as rough as positions are rounded.
bool Simulation::State::quiet() {
  constexpr double kEnergyShare = 1e-6, kForceShare = 0.01;
  const double given = scene.environment.gravity.norm();
  const double gravity = given > 0 ? given : kStandardGravity;
  bool quiet = time() >= rest_after;
  Matrix3Xd v;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    Sheet& sheet = sheets[s];
    const Grid& grid = scene.sheets[s].grid;
    const double height = (std::max(grid.rows, grid.columns) - 1) * grid.spacing;
    sheet.solver->velocities(v);
    const double most_change = kForceShare * gravity * scene.solver.frame_step;
    quiet = quiet && sheet.velocities.size() > 0;
    double energy = 0;
    for (Eigen::Index i = 0; quiet && i < v.cols(); ++i) {
      if (sheet.dynamics.inverse_mass[i] == 0) continue;
      energy += sheet.mesh.mass[i] / 2 * v.col(i).squaredNorm();
      quiet = (v.col(i) - sheet.velocities.col(i)).norm() <= most_change;
    }
    quiet = quiet && energy <= kEnergyShare * sheet.mesh.mass.sum() * gravity * height;
    sheet.velocities.swap(v);
  }
  return quiet;
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
  const bool asleep = at_rest() && !state.scene.environment.wind;
  state.substeps = asleep ? 0 : step.substeps;
  if (asleep) {
    ++state.frame;
    return true;
  }

  const double begin = state.time();
  for (std::int64_t k = 0; k < step.substeps; ++k)
    state.step(begin + static_cast<double>(k) * step.substep, step.substep);
  for (const Sheet& sheet : state.sheets)
    if (!sheet.solver->finite()) return false;
  ++state.frame;
  state.frames_at_rest = state.quiet() ? state.frames_at_rest + 1 : 0;
  return true;
}

std::int64_t Simulation::substeps() const { return state_->substeps; }

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
  Matrix3Xd x;
  for (const Sheet& sheet : state_->sheets) {
    sheet.solver->positions(x);
    copy_planes(x, first, out);
    first += x.cols();
  }
}

void Simulation::copy_velocities(std::span<double> out) const {
  Eigen::Index first = 0;
  Matrix3Xd v;
  for (const Sheet& sheet : state_->sheets) {
    sheet.solver->velocities(v);
    copy_planes(v, first, out);
    first += v.cols();
  }
}

FrameStats Simulation::stats() const {
  FrameStats stats;
  Matrix3Xd x, v;
  for (const Sheet& sheet : state_->sheets) {
    sheet.solver->positions(x);
    sheet.solver->velocities(v);
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
  std::vector<Matrix3Xd> x(state.sheets.size()), v(state.sheets.size());
  for (std::size_t s = 0; s < state.sheets.size(); ++s) {
    state.sheets[s].solver->positions(x[s]);
    state.sheets[s].solver->closing_velocities(state.time(), v[s]);
  }

  const Textile old_textile = std::exchange(definition.textile, textile);
  set_textile_of(state.scene, definition, state.sheets[index]);
  Plan plan = state.plan_for(x);
  if (const auto refused = refusal_of(plan.step, state.scene.solver.allow_unstable)) {
    definition.textile = old_textile;
    set_textile_of(state.scene, definition, state.sheets[index]);
    return refused;
  }
  state.plan = std::move(plan);

  // sheets whose forces and step stay go on as they were
  const double new_dt = state.plan.step.substep;
  for (std::size_t s = 0; s < state.sheets.size(); ++s) {
    Sheet& sheet = state.sheets[s];
    if (s == index) sheet.solver = make_solver(state.scene, definition, sheet.dynamics);
    if (s == index || new_dt != dt) sheet.solver->start(x[s], v[s], state.time(), new_dt);
  }
  state.frames_at_rest = 0;
  return std::nullopt;
}

}  // namespace weft

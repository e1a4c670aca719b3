#include "core/simulation.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <sstream>

#include "core/contact/contact.h"
#include "core/forces/air.h"
#include "core/forces/springs.h"
#include "core/model/self_weight.h"
#include "core/motion/energy_budget.h"
#include "core/motion/guard.h"
#include "core/motion/sheet_solver.h"
#include "core/motion/stability.h"

namespace weft {
namespace {

// A sheet in motion.
struct Sheet {
  explicit Sheet(const SheetDefinition& definition) : start(definition) {}

  StartPositions start;  // that paths are relative to
  Mesh mesh;
  Dynamics dynamics;  // the forces in double
  std::unique_ptr<SheetSolver> solver;
  double skin = 0;  // m
  double most_strain = kMostStrain;
  EnergyBudget budget;
  std::optional<TextileRamp> ramp;

  // At the end of the last frame. Between frames it is what the solver holds.
  const SheetState& good() const {
    if (good_.x.size() == 0) read(good_);
    return good_;
  }
  void read_good() { read(good_); }
  void set_good(SheetState& state) { std::swap(good_, state); }
  void forget_good() { good_ = {}; }

  void read(SheetState& state) const {
    solver->positions(state.x);
    solver->velocities(state.v);
    state.kinetic_energy = kinetic_energy(mesh, state.v);
  }

 private:
  mutable SheetState good_;  // empty: not looked at since
};

// Sheets at the end of the frame that is being computed.
using NextStates = std::vector<SheetState>;

// One for every thread that computes frames: between them no simulation needs its own.
NextStates& next_states(std::size_t sheets) {
  static thread_local NextStates states;
  states.resize(sheets);
  return states;
}

// What the guard says of an attempt at a frame.
struct Attempt {
  std::vector<Verdict> sheets;
  std::string reason;  // the first of theirs; empty: the frame is good
  int halvings = 0;

  // Whether every sheet that is in doubt does here as it did there.
  bool confirms(const Attempt& other) const {
    for (std::size_t s = 0; s < sheets.size(); ++s)
      if (!sheets[s].reason.empty() && !weft::confirms(sheets[s], other.sheets[s])) return false;
    return true;
  }
};

// Held particles follow the paths of their pins.
void move_pins(const SheetDefinition& definition, double time, double dt, Sheet& sheet) {
  for (const Pin& pin : definition.pins) {
    if (pin.path.empty()) continue;
    const Vector3d offset = offset_at(pin.path, time);
    const Vector3d displacement = offset - offset_at(pin.path, time - dt);
    for (const int i : pin.particles) {
      sheet.solver->move_held(i, sheet.start(i) + offset, displacement);
    }
  }
}

// From which a sheet may fall within itself, m.
double height_of(const SheetDefinition& sheet) {
  return (std::max(sheet.grid.rows, sheet.grid.columns) - 1) * sheet.grid.spacing;
}

// 1/kg, 0 where a pin holds a particle.
VectorXd inverse_mass_of(const Mesh& mesh, const std::vector<Pin>& pins) {
  VectorXd inverse_mass = mesh.mass.cwiseInverse();
  for (const Pin& pin : pins)
    for (const int i : pin.particles) inverse_mass[i] = 0;
  return inverse_mass;
}

void set_textile_of(const Scene& scene, const SheetDefinition& definition, Sheet& sheet) {
  sheet.mesh = make_lattice(definition);
  if (const auto& ratio = definition.textile.damping_ratio)
    sheet.mesh.damping = damping_for(sheet.mesh, *ratio);
  else if (!definition.textile.damping)
    sheet.mesh.damping = std::max(kDefaultDamping, damping_for(sheet.mesh, kSafeDampingRatio));
  if (!scene.environment.wind) sheet.mesh.triangles = std::vector<std::array<int, 3>>();
  sheet.dynamics.inverse_mass = inverse_mass_of(sheet.mesh, definition.pins);
  sheet.dynamics.drag = sheet.mesh.drag;
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

// Positions and velocities of all sheets, to begin again with other forces or another step.
struct SheetStates {
  std::vector<Matrix3Xd> x, v;
};

// Gives held particles the velocity of their paths in a step from `time` on.
void set_pin_velocities(const std::vector<Pin>& pins, double time, double dt, Matrix3Xd& v) {
  for (const Pin& pin : pins)
    for (const int i : pin.particles)
      v.col(i) = (offset_at(pin.path, time + dt) - offset_at(pin.path, time)) / dt;
}

}  // namespace

std::unique_ptr<SheetSolver> make_solver(const Scene& scene, const SheetDefinition& sheet,
                                         const Dynamics& dynamics) {
  if (!needs_plain_solver(scene, sheet).empty())
    return make_plain_solver(dynamics, scene.solver.integrator);
  return make_lattice_solver(sheet, dynamics, scene.environment.wind, scene.solver);
}

// A frame that is being computed.
struct UnfinishedFrame {
  std::int64_t substeps = 0;        // taken by this attempt
  std::optional<Attempt> doubtful;  // the attempt before it, with twice the step
  std::size_t repairs = 0;          // before the frame
  int halvings = 0;                 // before the frame
  std::optional<Snapshot> before;   // where it can be dropped
};

struct Simulation::State {
  Scene scene;
  SolverFactory make_solver;
  std::int64_t most_substeps = kMaxSubsteps;
  Plan plan;
  std::vector<Sheet> sheets;
  std::vector<Grab> grabs;  // their pins are among the scene's
  std::int64_t frame = 0;
  int frames_at_rest = 0;
  std::int64_t substeps = 0;  // of the last frame
  double rest_after = 0;      // s
  int halvings = 0;           // of the planned step
  bool textile_changed = false;
  std::vector<Repair> repairs;
  std::string failure;
  std::optional<UnfinishedFrame> unfinished;

  State(Scene given, SolverFactory factory);
  SheetDefinition capped(std::size_t sheet) const;
  SheetDefinition stepped(std::size_t sheet) const;
  void put_textile(std::size_t sheet, const Textile& textile);
  Plan plan_now() const;
  std::optional<StepRefusal> set_textile(std::size_t sheet, const Textile& textile);
  bool change_textiles();
  void bind_forces();
  void step(double time, double dt, ThreadPool& pool);
  bool begin_frame(bool in_parts);
  FramePart compute_frame(const Enough& enough, ThreadPool& pool, NextStates& next);
  bool take_substeps(const Enough& enough, ThreadPool& pool);
  Attempt look_at(NextStates& next);
  bool halve(const char* what, const std::string& reason);
  bool keep_to_budget(NextStates& next);
  void restart_from(NextStates& next);
  bool quiet(const NextStates& next) const;
  void set_halvings(int count);
  int particle_count() const;
  std::optional<StepRefusal> refusal_of(const StepPlan& step) const;
  Snapshot snapshot() const;
  void go_back_to(const Snapshot& before);
  Handling handling() const;
  Moment moment() const;
  void adopt(Handling handling);
  VectorXd planned_inverse_mass(std::size_t sheet) const;
  SheetStates closing_states() const;
  void restart(const SheetStates& states, double old_dt, const std::vector<bool>& changed);
  Plan plan_for(const std::vector<Matrix3Xd>& x) const;
  bool take_over(const Snapshot& snapshot);
  double time() const { return static_cast<double>(frame) * scene.solver.frame_step; }
};

// A sheet as it is simulated, but for its damping.
SheetDefinition Simulation::State::capped(std::size_t sheet) const {
  SheetDefinition definition = scene.sheets[sheet];
  if (const auto& strain = scene.solver.max_self_weight_strain)
    definition.textile = cap_stretch(definition, scene.environment, *strain);
  return definition;
}

// A sheet as it is simulated, once it has a mesh.
SheetDefinition Simulation::State::stepped(std::size_t sheet) const {
  SheetDefinition definition = capped(sheet);
  definition.textile.damping = sheets[sheet].mesh.damping;
  return definition;
}

// One substep, from `time` to `time` + dt.
void Simulation::State::step(double time, double dt, ThreadPool& pool) {
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    Sheet& sheet = sheets[s];
    const SheetDefinition& definition = scene.sheets[s];

    // forces and motion
    sheet.solver->advance(time, pool);
    move_pins(definition, time + dt, dt, sheet);

    // contact last, so that no particle ends a step inside a collider
    if (!scene.colliders.empty())
      sheet.solver->resolve(
          Contacts(scene.colliders, definition.textile.friction, sheet.skin, time + dt, dt), pool);
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

Simulation::State::State(Scene given, SolverFactory factory)
    : scene(std::move(given)),
      make_solver(std::move(factory)),
      sheets(scene.sheets.begin(), scene.sheets.end()),
      rest_after(end_of_paths(scene)) {
  std::vector<Matrix3Xd> x(sheets.size());
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const SheetDefinition definition = capped(s);
    set_textile_of(scene, definition, sheets[s]);
    x[s] = start_positions(definition);
    for (const Pin& pin : definition.pins)
      for (const int i : pin.particles) x[s].col(i) += offset_at(pin.path, 0);
  }
  bind_forces();
  plan = plan_for(x);

  const double dt = plan.step.substep;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const SheetDefinition definition = stepped(s);
    Matrix3Xd v = start_velocities(definition);
    set_pin_velocities(definition.pins, 0, dt, v);
    sheets[s].solver = make_solver(scene, definition, sheets[s].dynamics);
    sheets[s].solver->start(x[s], v, 0, dt);
    sheets[s].most_strain = std::max(kMostStrain, 2 * largest_strain(sheets[s].mesh, x[s]));
  }
}

// x: positions of each sheet.
Plan Simulation::State::plan_for(const std::vector<Matrix3Xd>& x) const {
  std::vector<VectorXd> inverse_mass;
  for (std::size_t s = 0; s < sheets.size(); ++s) inverse_mass.push_back(planned_inverse_mass(s));
  std::vector<SheetShape> shapes;
  shapes.reserve(sheets.size());
  for (std::size_t s = 0; s < sheets.size(); ++s)
    shapes.push_back({sheets[s].mesh, inverse_mass[s], x[s]});
  Plan made = make_plan(scene, shapes);
  if (made.step.substeps <= kMaxSubsteps) {  // repairs stay
    made.step.substeps <<= halvings;
    made.step.substep = scene.solver.frame_step / static_cast<double>(made.step.substeps);
  }
  return made;
}

// 1/kg. What is only grabbed counts as free: no step is longer for that, and none shorter after it.
VectorXd Simulation::State::planned_inverse_mass(std::size_t sheet) const {
  VectorXd inverse_mass = sheets[sheet].dynamics.inverse_mass;
  for (const Grab& grab : grabs)
    if (grab.sheet == sheet && !grab.pinned)
      inverse_mass[grab.particle] = 1 / sheets[sheet].mesh.mass[grab.particle];
  return inverse_mass;
}

Handling Simulation::State::handling() const {
  Handling handling{{}, {}, grabs};
  for (const SheetDefinition& sheet : scene.sheets) handling.pins.push_back(sheet.pins);
  for (const Collider& collider : scene.colliders) handling.paths.push_back(collider.path);
  return handling;
}

void Simulation::State::adopt(Handling handling) {
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    scene.sheets[s].pins = std::move(handling.pins[s]);
    sheets[s].dynamics.inverse_mass = inverse_mass_of(sheets[s].mesh, scene.sheets[s].pins);
  }
  for (std::size_t c = 0; c < scene.colliders.size(); ++c)
    scene.colliders[c].path = std::move(handling.paths[c]);
  grabs = std::move(handling.grabs);
  rest_after = end_of_paths(scene);
}

Moment Simulation::State::moment() const {
  return {scene, time(), [this](std::size_t s, int i) { return sheets[s].start(i); },
          [this](std::size_t s, int i) { return sheets[s].good().x.col(i); }};
}

SheetStates Simulation::State::closing_states() const {
  SheetStates states;
  for (const Sheet& sheet : sheets) {
    states.x.push_back(sheet.good().x);
    sheet.solver->closing_velocities(time(), states.v.emplace_back());
  }
  return states;
}

// Sheets whose forces and step stay go on as they were.
void Simulation::State::restart(const SheetStates& states, double old_dt,
                                const std::vector<bool>& changed) {
  const double dt = plan.step.substep;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    sheets[s].budget = {};
    if (!changed[s] && dt == old_dt) continue;
    sheets[s].solver->start(states.x[s], states.v[s], time(), dt);
    sheets[s].read_good();
  }
}

void Simulation::State::put_textile(std::size_t sheet, const Textile& textile) {
  scene.sheets[sheet].textile = textile;
  set_textile_of(scene, capped(sheet), sheets[sheet]);
}

Plan Simulation::State::plan_now() const {
  std::vector<Matrix3Xd> x;
  for (const Sheet& sheet : sheets) x.push_back(sheet.good().x);
  return plan_for(x);
}

std::optional<StepRefusal> Simulation::State::set_textile(std::size_t sheet,
                                                          const Textile& textile) {
  const double dt = plan.step.substep;
  const SheetStates before = closing_states();
  const Textile old = scene.sheets[sheet].textile;
  put_textile(sheet, textile);
  Plan made = plan_now();
  if (const auto refused = refusal_of(made.step)) {
    put_textile(sheet, old);
    return refused;
  }
  plan = std::move(made);
  sheets[sheet].solver = make_solver(scene, stepped(sheet), sheets[sheet].dynamics);
  std::vector<bool> changed(sheets.size());
  changed[sheet] = true;
  restart(before, dt, changed);
  return std::nullopt;
}

// Gives sheets the textiles of the frame to come; false: one does not bear the step.
bool Simulation::State::change_textiles() {
  textile_changed = false;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    auto& ramp = sheets[s].ramp;
    if (!ramp) continue;
    if (const auto refused = set_textile(s, ramp->at(frame + 1))) {  // since particles were let go
      std::ostringstream why;
      why << "frame " << frame + 1 << " cannot be computed: as the textile of "
          << scene.sheets[s].name << " changes, ";
      if (refused->too_many_substeps)
        why << "it needs " << refused->substeps << " substeps; at most " << refused->most_substeps
            << " are computed";
      else
        why << "a substep of " << refused->asked << " s lies above its linear bound of "
            << refused->bound << " s";
      failure = why.str();
      return false;
    }
    if (frame + 1 == ramp->end) ramp.reset();
    textile_changed = true;
    frames_at_rest = 0;
  }
  return true;
}

// Whether in the frame being computed kinetic energy and net forces, contact included, were small:
// forces as means over the frame, for those of one step are as rough as positions are rounded, and
// as root mean square over the sheet, for single particles of stiff, light sheets chatter for ever.
bool Simulation::State::quiet(const NextStates& next) const {
  constexpr double kEnergyShare = 1e-6, kForceShare = 0.01;
  if (frame == 0 || time() + scene.solver.frame_step < rest_after) return false;
  const double given = scene.environment.gravity.norm();
  const double gravity = given > 0 ? given : kStandardGravity;
  const double most_change = kForceShare * gravity * scene.solver.frame_step;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const Sheet& sheet = sheets[s];
    const double height = height_of(scene.sheets[s]);
    const Matrix3Xd &v = next[s].v, &before = sheet.good().v;
    double energy = 0, squares = 0;
    int free = 0;
    for (Eigen::Index i = 0; i < v.cols(); ++i) {
      if (sheet.dynamics.inverse_mass[i] == 0) continue;
      energy += sheet.mesh.mass[i] / 2 * v.col(i).squaredNorm();
      squares += (v.col(i) - before.col(i)).squaredNorm();
      ++free;
    }
    if (squares > free * most_change * most_change) return false;
    if (energy > kEnergyShare * sheet.mesh.mass.sum() * gravity * height) return false;
  }
  return true;
}

// False: the frame cannot be computed.
bool Simulation::State::begin_frame(bool in_parts) {
  // saving costs as much as up to 17 substeps of a lattice in single precision
  constexpr std::int64_t kWorthSaving = 1000;
  std::optional<Snapshot> before;
  if (in_parts && plan.step.substeps >= kWorthSaving) before = snapshot();
  if (!change_textiles()) return false;
  for (const Sheet& sheet : sheets) sheet.good();  // to go back to, and to show
  unfinished = {0, {}, repairs.size(), halvings, std::move(before)};
  return true;
}

// Takes those that the attempt has left; false: some still are, and it is enough.
bool Simulation::State::take_substeps(const Enough& enough, ThreadPool& pool) {
  constexpr int kParticles = 4096;  // whose substep takes longer than to ask
  const std::int64_t turn = std::max(1, kParticles / particle_count());
  const double begin = time(), dt = plan.step.substep;
  for (std::int64_t& k = unfinished->substeps; k < plan.step.substeps;) {
    step(begin + static_cast<double>(k) * dt, dt, pool);
    ++k;
    if (enough && k % turn == 0 && k < plan.step.substeps && enough()) return false;
  }
  return true;
}

// Has the guard look at the state that the solvers have come to.
Attempt Simulation::State::look_at(NextStates& next) {
  const double begin = time();
  Attempt made{{}, {}, halvings};
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    Sheet& sheet = sheets[s];
    sheet.read(next[s]);
    const Drive drive{scene.environment.gravity,
                      drive_speed(scene, scene.sheets[s], begin, begin + scene.solver.frame_step),
                      scene.solver.frame_step};
    made.sheets.push_back(
        scene.solver.max_repairs == 0
            ? inspect_finite(next[s])
            : inspect(sheet.mesh, drive, sheet.most_strain, sheet.good(), next[s]));
    if (made.reason.empty() && !made.sheets.back().reason.empty())
      made.reason = scene.sheets[s].name + ": " + made.sheets.back().reason;
  }
  return made;
}

// Attempts the frame until it can be trusted, repairs are used up, or it is enough.
FramePart Simulation::State::compute_frame(const Enough& enough, ThreadPool& pool,
                                           NextStates& next) {
  while (take_substeps(enough, pool)) {
    Attempt made = look_at(next);
    if (made.reason.empty()) return FramePart::kDone;
    auto& doubtful = unfinished->doubtful;
    if (doubtful && made.confirms(*doubtful)) {
      // the longer step was right: it goes on from here
      for (std::size_t s = 0; s < sheets.size(); ++s)
        sheets[s].most_strain = std::max(sheets[s].most_strain, 2 * made.sheets[s].strain);
      set_halvings(doubtful->halvings);
      repairs.resize(unfinished->repairs +
                     static_cast<std::size_t>(halvings - unfinished->halvings));
      restart_from(next);
      return FramePart::kDone;
    }

    if (!halve("computed", made.reason)) return FramePart::kFailed;
    // back to the last good frame
    for (Sheet& sheet : sheets)
      sheet.solver->start(sheet.good().x, sheet.good().v, time(), plan.step.substep);
    unfinished->substeps = 0;
    doubtful = std::move(made);
  }
  return FramePart::kUnfinished;
}

// Solvers go on from the end of the frame with the step as it now is.
void Simulation::State::restart_from(NextStates& next) {
  const double end = time() + scene.solver.frame_step;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    Matrix3Xd v;
    sheets[s].solver->closing_velocities(end, v);
    sheets[s].solver->start(next[s].x, v, end, plan.step.substep);
    sheets[s].read(next[s]);
  }
}

// Halves the step from the frame's end on where energy came from nothing; false: repairs are used
// up.
bool Simulation::State::keep_to_budget(NextStates& next) {
  if (scene.solver.max_repairs == 0) return true;
  const double begin = time(), frame_step = scene.solver.frame_step;
  std::string reason;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const SheetDefinition& definition = scene.sheets[s];
    const Mesh& mesh = sheets[s].mesh;
    EnergyBudget& budget = sheets[s].budget;
    const Drive drive{scene.environment.gravity,
                      motion_speed(scene, definition, begin, begin + frame_step), frame_step};
    budget.given += work_of_motion(mesh, drive, budget.stored);
    budget.substeps += plan.step.substeps;
    if (budget.substeps < kAuditSubsteps) continue;
    const std::string why =
        audit(mesh, drive, height_of(definition), wind_speed(scene), next[s], budget);
    if (reason.empty() && !why.empty()) reason = definition.name + ": " + why;
  }
  if (reason.empty()) return true;
  if (!halve("trusted", reason)) return false;
  restart_from(next);
  for (Sheet& sheet : sheets) sheet.budget = {};
  return true;
}

// Repairs the frame under way; false: that is not possible any more.
bool Simulation::State::halve(const char* what, const std::string& reason) {
  if (halvings >= scene.solver.max_repairs || 2 * plan.step.substeps > most_substeps) {
    failure = "frame " + std::to_string(frame + 1) + " cannot be " + what + " after " +
              std::to_string(halvings) + " halvings of the step: " + reason;
    return false;
  }
  set_halvings(halvings + 1);
  repairs.push_back({frame + 1, plan.step.substep, reason});
  return true;
}

void Simulation::State::set_halvings(int count) {
  StepPlan& planned = plan.step;
  planned.substeps = (planned.substeps >> halvings) << count;
  planned.substep = scene.solver.frame_step / static_cast<double>(planned.substeps);
  halvings = count;
}

Simulation::Simulation(Scene scene) : Simulation(std::move(scene), weft::make_solver) {}
Simulation::Simulation(Scene scene, SolverFactory make_solver)
    : state_(std::make_unique<State>(std::move(scene), std::move(make_solver))) {}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

const Scene& Simulation::scene() const { return state_->scene; }
const Plan& Simulation::plan() const { return state_->plan; }
std::int64_t Simulation::frame() const { return state_->frame; }
double Simulation::time() const { return state_->time(); }

std::optional<StepRefusal> Simulation::refusal() const {
  return state_->refusal_of(state_->plan.step);
}

void Simulation::limit_frame_work(std::int64_t most) {
  state_->most_substeps = std::min(kMaxSubsteps, most / std::max(1, particle_count()));
}

bool Simulation::advance_frame(ThreadPool& pool) {
  return advance_frame({}, pool) == FramePart::kDone;
}

FramePart Simulation::advance_frame(const Enough& enough, ThreadPool& pool) {
  assert(!refusal());
  State& state = *state_;
  if (asleep()) {
    state.substeps = 0;
    state.textile_changed = false;
    ++state.frame;
    return FramePart::kDone;
  }

  NextStates& next = next_states(state.sheets.size());
  if (!state.failure.empty()) return FramePart::kFailed;
  if (!state.unfinished && !state.begin_frame(enough != nullptr)) return FramePart::kFailed;
  const FramePart part = state.compute_frame(enough, pool, next);
  if (part == FramePart::kUnfinished) return part;
  state.unfinished.reset();
  if (part == FramePart::kFailed) return part;
  state.substeps = state.plan.step.substeps;
  if (!state.keep_to_budget(next)) return FramePart::kFailed;
  state.frames_at_rest = state.quiet(next) ? state.frames_at_rest + 1 : 0;
  for (std::size_t s = 0; s < next.size(); ++s) state.sheets[s].set_good(next[s]);
  ++state.frame;
  return FramePart::kDone;
}

double Simulation::frame_share() const {
  const auto& unfinished = state_->unfinished;
  if (!unfinished) return 0;
  return static_cast<double>(unfinished->substeps) /
         static_cast<double>(state_->plan.step.substeps);
}

bool Simulation::drop_frame() {
  auto& unfinished = state_->unfinished;
  if (!unfinished || !unfinished->before) return false;
  const Snapshot before = std::move(*unfinished->before);
  unfinished.reset();
  state_->go_back_to(before);
  return true;
}

void Simulation::release_memory() {
  // solvers are beyond the last good frame
  if (!state_->failure.empty() || state_->unfinished) return;
  for (Sheet& sheet : state_->sheets) {
    sheet.forget_good();
    sheet.solver->release_memory();
  }
}

int Simulation::most_threads() const {
  int most = 1;
  for (const Sheet& sheet : state_->sheets) most = std::max(most, sheet.solver->most_threads());
  return most;
}

const std::vector<Repair>& Simulation::repairs() const { return state_->repairs; }
const std::string& Simulation::failure() const { return state_->failure; }

std::int64_t Simulation::substeps() const { return state_->substeps; }

bool Simulation::at_rest() const {
  constexpr int kFrames = 30;
  return state_->frames_at_rest >= kFrames;
}

bool Simulation::asleep() const { return at_rest() && !state_->scene.environment.wind; }

int Simulation::particle_count() const { return state_->particle_count(); }

int Simulation::State::particle_count() const {
  int count = 0;
  for (const SheetDefinition& sheet : scene.sheets) count += sheet.particle_count();
  return count;
}

std::optional<StepRefusal> Simulation::State::refusal_of(const StepPlan& step) const {
  return find_refusal(step, scene.solver, most_substeps);
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
    copy_planes(sheet.good().x, first, out);
    first += sheet.good().x.cols();
  }
}

void Simulation::copy_velocities(std::span<double> out) const {
  Eigen::Index first = 0;
  for (const Sheet& sheet : state_->sheets) {
    copy_planes(sheet.good().v, first, out);
    first += sheet.good().v.cols();
  }
}

FrameStats Simulation::stats() const {
  FrameStats stats;
  for (const Sheet& sheet : state_->sheets) {
    const Matrix3Xd& x = sheet.good().x;
    stats.kinetic_energy += sheet.good().kinetic_energy;
    stats.potential_energy += spring_energy(sheet.mesh, x) + isometric_energy(sheet.mesh, x) -
                              sheet.mesh.mass.dot(x.transpose() * sheet.dynamics.gravity);
    stats.largest_strain = std::max(stats.largest_strain, largest_strain(sheet.mesh, x));
  }
  return stats;
}

std::optional<StepRefusal> Simulation::set_textile(std::size_t index, const Textile& textile,
                                                   double duration) {
  State& state = *state_;
  Sheet& sheet = state.sheets[index];
  const Textile now = state.scene.sheets[index].textile;
  if (!sheet.ramp && textile == now) return std::nullopt;
  const double frames = std::ceil(duration / state.scene.solver.frame_step - 1e-9);
  if (frames <= 1) {
    if (const auto refused = state.set_textile(index, textile)) return refused;
    sheet.ramp.reset();
  } else {
    state.put_textile(index, textile);
    const Plan plan = state.plan_now();
    state.put_textile(index, now);
    if (const auto refused = state.refusal_of(plan.step)) return refused;
    const std::int64_t begin = state.frame;
    sheet.ramp = {now, textile, begin, begin + static_cast<std::int64_t>(frames)};
  }
  state.frames_at_rest = 0;
  return std::nullopt;
}

const Textile& Simulation::target_textile(std::size_t index) const {
  const auto& ramp = state_->sheets[index].ramp;
  return ramp ? ramp->to : state_->scene.sheets[index].textile;
}

bool Simulation::textile_changed() const { return state_->textile_changed; }

Handling Simulation::handling() const { return state_->handling(); }

std::vector<Problem> Simulation::problems_of(const std::vector<Action>& actions) const {
  Handling after = handling();
  return handle(state_->moment(), actions, after);
}

namespace {

bool holds_the_same(const Handling& one, const Handling& other) {
  const auto same_particles = [](const Pin& a, const Pin& b) { return a.particles == b.particles; };
  const auto same_pins = [&](const std::vector<Pin>& a, const std::vector<Pin>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), same_particles);
  };
  const auto same_grab = [](const Grab& a, const Grab& b) { return a.pinned == b.pinned; };
  return std::equal(one.pins.begin(), one.pins.end(), other.pins.begin(), same_pins) &&
         std::equal(one.grabs.begin(), one.grabs.end(), other.grabs.begin(), other.grabs.end(),
                    same_grab);
}

}  // namespace

std::optional<StepRefusal> Simulation::act(const std::vector<Action>& actions) {
  State& state = *state_;
  const Handling before = handling();
  Handling after = before;
  [[maybe_unused]] const auto problems = handle(state.moment(), actions, after);
  assert(problems.empty());
  if (holds_the_same(before, after)) {
    state.adopt(std::move(after));
    state.frames_at_rest = 0;
    return std::nullopt;
  }

  SheetStates states = state.closing_states();
  const double dt = state.plan.step.substep;
  std::vector<VectorXd> held, planned;
  for (std::size_t s = 0; s < state.sheets.size(); ++s) {
    held.push_back(state.sheets[s].dynamics.inverse_mass);
    planned.push_back(state.planned_inverse_mass(s));
  }
  state.adopt(std::move(after));
  std::vector<bool> changed(state.sheets.size());
  bool plans = false;
  for (std::size_t s = 0; s < state.sheets.size(); ++s) {
    changed[s] = state.sheets[s].dynamics.inverse_mass != held[s];
    plans = plans || state.planned_inverse_mass(s) != planned[s];
  }
  if (plans) {
    Plan plan = state.plan_now();
    if (const auto refused = state.refusal_of(plan.step)) {
      state.adopt(before);
      return refused;
    }
    state.plan = std::move(plan);
  }
  for (std::size_t s = 0; s < state.sheets.size(); ++s)
    set_pin_velocities(state.scene.sheets[s].pins, state.time(), state.plan.step.substep,
                       states.v[s]);
  state.restart(states, dt, changed);
  state.frames_at_rest = 0;
  return std::nullopt;
}

Snapshot Simulation::snapshot() const { return state_->snapshot(); }

Snapshot Simulation::State::snapshot() const {
  assert(failure.empty() && !unfinished);
  Snapshot snapshot{frame, substeps, frames_at_rest, halvings, plan, repairs, {}, handling()};
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const Sheet& sheet = sheets[s];
    snapshot.sheets.push_back({scene.sheets[s].textile, sheet.most_strain, sheet.good().x,
                               sheet.good().v, sheet.solver->save(), sheet.ramp, sheet.budget});
  }
  return snapshot;
}

// Precondition: what was taken since has changed nothing but textiles that ramp.
void Simulation::State::go_back_to(const Snapshot& before) {
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    if (scene.sheets[s].textile == before.sheets[s].textile) continue;
    put_textile(s, before.sheets[s].textile);
    sheets[s].solver = make_solver(scene, stepped(s), sheets[s].dynamics);
  }
  [[maybe_unused]] const bool taken = take_over(before);
  assert(taken);
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const Snapshot::Sheet& saved = before.sheets[s];
    SheetState good{saved.x, saved.v, kinetic_energy(sheets[s].mesh, saved.v)};
    sheets[s].set_good(good);
  }
}

bool Simulation::restore(const Snapshot& snapshot) {
  if (!fits(state_->scene, snapshot)) return false;
  Scene scene = state_->scene;
  for (std::size_t s = 0; s < scene.sheets.size(); ++s) {
    scene.sheets[s].textile = snapshot.sheets[s].textile;
    scene.sheets[s].pins = snapshot.handling.pins[s];
  }
  for (std::size_t c = 0; c < scene.colliders.size(); ++c)
    scene.colliders[c].path = snapshot.handling.paths[c];
  if (!find_problems(scene).empty()) return false;
  auto restored = std::make_unique<State>(std::move(scene), state_->make_solver);
  restored->most_substeps = state_->most_substeps;
  if (!restored->take_over(snapshot)) return false;
  state_ = std::move(restored);
  return true;
}

// False where a solver saved something else.
bool Simulation::State::take_over(const Snapshot& snapshot) {
  frame = snapshot.frame;
  frames_at_rest = snapshot.frames_at_rest;
  substeps = snapshot.substeps;
  halvings = snapshot.halvings;
  plan = snapshot.plan;
  repairs = snapshot.repairs;
  grabs = snapshot.handling.grabs;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    Sheet& sheet = sheets[s];
    const Snapshot::Sheet& saved = snapshot.sheets[s];
    sheet.most_strain = saved.most_strain;
    sheet.ramp = saved.ramp;
    sheet.budget = saved.budget;
    sheet.solver->start(saved.x, saved.v, time(), plan.step.substep);
    if (!sheet.solver->load(saved.solver)) return false;
  }
  return true;
}

}  // namespace weft

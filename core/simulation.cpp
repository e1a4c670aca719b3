#include "core/simulation.h"

#include <algorithm>
#include <cassert>

#include "core/cloth_contact/tangles.h"
#include "core/contact/contact.h"
#include "core/forces/air.h"
#include "core/forces/elastic.h"
#include "core/model/self_weight.h"
#include "core/simulation_state.h"

namespace weft {
namespace {

// One for every thread that computes frames: between them no simulation needs its own.
NextStates& next_states(std::size_t sheets) {
  static thread_local NextStates states;
  states.resize(sheets);
  return states;
}

// m/s. Gently while garments are put on, for what holds them up is not to slip.
double untangling_speed(const Scene& scene, double time) {
  if (time >= end_of_untangling(scene)) return 0;
  const double dressed = scene.dressing ? scene.dressing->end() : 0;
  return Untangling::speed_at(std::max(0.0, time - dressed));
}

}  // namespace

// One frame, or a part of one. It is attempted until the guard trusts it.
FramePart Simulation::State::advance_frame(const Enough& enough, ThreadPool& pool) {
  if (!unfinished && !begin_frame(enough != nullptr, pool)) return FramePart::kFailed;

  if (!relax_coarser(enough, pool)) return FramePart::kUnfinished;
  NextStates& next = next_states(sheets.size());
  for (Decision decision = Decision::kAgain; decision == Decision::kAgain;) {
    if (!take_substeps(enough, pool)) return FramePart::kUnfinished;
    decision = repair(inspect_sheets(next, pool), next);
    if (decision != Decision::kImpossible) continue;
    unfinished.reset();
    return FramePart::kFailed;
  }
  unfinished.reset();
  substeps = plan.step.substeps;

  if (!keep_to_budget(next)) return FramePart::kFailed;
  if (is_relaxing())
    relax(quiet(next), next);
  else
    rest.add_frame(quiet(next));
  for (std::size_t s = 0; s < next.size(); ++s) sheets[s].set_good(next[s]);
  ++frame;
  return FramePart::kDone;
}

// Takes those that the attempt has left; false: some still are, and it is enough.
bool Simulation::State::take_substeps(const Enough& enough, ThreadPool& pool) {
  constexpr int kParticles = 4096;  // whose substep takes longer than to ask, or any with contact
  const std::int64_t turn = cloth_contact ? 1 : std::max(1, kParticles / particle_count());
  const double begin = time(), dt = plan.step.substep;
  constexpr std::int64_t kSettlings = 16;  // of a frame
  const std::int64_t settling = std::max<std::int64_t>(1, plan.step.substeps / kSettlings);
  const bool settles = is_relaxing() && relaxation->settling > 0;
  if (cloth_contact && unfinished->substeps == 0)
    cloth_contact->begin_frame(sheets, repairs.tangled(), untangling_speed(scene, begin), pool);
  for (std::int64_t& k = unfinished->substeps; k < plan.step.substeps;) {
    step(begin + static_cast<double>(k) * dt, dt, plan.step.slow_in(k), k + 1 == plan.step.substeps,
         pool);
    ++k;
    if (settles && k % settling == 0) settle(begin + static_cast<double>(k) * dt);
    if (enough && k % turn == 0 && k < plan.step.substeps && enough()) return false;
  }
  return true;
}

// One substep, from `time` to `time` + dt; slow forces act so many times as strongly.
void Simulation::State::step(double time, double dt, int slow, bool ends_frame, ThreadPool& pool) {
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    MovingSheet& sheet = sheets[s];
    const SheetDefinition& definition = scene.sheets[s];

    // forces and motion
    sheet.solver->advance(time, slow, pool);
    move_pins(definition.pins, time + dt, dt, sheet);
    if (!sheet.dynamics.tethers.empty()) sheet.solver->pull_back(pool);
  }
  if (scene.dressing) hold_heights(scene, time + dt, sheets);
  if (!scene.colliders.empty()) bodies.place(scene.colliders, time + dt, dt);
  for (std::size_t s = 0; s < open_seams.size(); ++s)
    open_seams[s].keep_out(contacts_of(s, time, dt), dt, sheets[s]);
  if (cloth_contact) cloth_contact->resolve(sheets, dt, ends_frame, pool);

  // colliders last, so that no particle ends a step inside one
  if (scene.colliders.empty()) return;
  const double pressed = cloth_contact ? cloth_contact->moved() : 0;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const Contacts contacts = contacts_of(s, time, dt, pressed);
    if (!box_edges.empty())
      cloth_contact->follow(box_edges[s].keep_out(contacts, dt, pressed, sheets[s]));
    sheets[s].solver->resolve(contacts, pool);
  }
}

// In the substep from `time` to `time` + dt; bodies are placed. pressed: contact.h.
Contacts Simulation::State::contacts_of(std::size_t sheet, double time, double dt,
                                        double pressed) const {
  double deflate = 0, growth = 0, friction = scene.sheets[sheet].textile.friction;
  if (scene.dressing) {
    const DressingState dressing = dressing_at(*scene.dressing, time + dt);
    deflate = dressing.deflate;
    growth = dressing_at(*scene.dressing, time).deflate - deflate;
    friction *= dressing.friction;
  }
  return {scene.colliders, bodies, friction, sheets[sheet].skin, time + dt, dt,
          deflate,         growth, pressed};
}

// False: the frame cannot be computed.
bool Simulation::State::begin_frame(bool in_parts, ThreadPool& pool) {
  // saving costs as much as up to 17 substeps of a lattice in single precision
  constexpr std::int64_t kWorthSaving = 1000;
  std::optional<Snapshot> before;
  if (in_parts && (plan.step.substeps >= kWorthSaving || (relaxation && !relaxation->begun)))
    before = snapshot();
  // before solvers begin anew and round places
  if (cloth_contact && untangling_speed(scene, time()) > 0) cloth_contact->count_cuts(sheets, pool);
  if (!change_dressing() || !change_textiles()) return false;
  for (const MovingSheet& sheet : sheets) sheet.good();  // to go back to, and to show
  if (repairs.grow(frame + 1, plan.step)) begin_again();
  repairs.begin_frame();
  unfinished = {0, begins_to_relax() ? coarser_simulation() : nullptr, std::move(before), 0};
  return true;
}

// Has the guard look at the state that the solvers have come to.
Attempt Simulation::State::inspect_sheets(NextStates& next, ThreadPool& pool) {
  const double begin = time();
  Attempt made;
  // what hits a sheet may leave it all its motion
  double given = 0;
  if (cloth_contact) {
    given = cloth_contact->given();
    for (const MovingSheet& sheet : sheets) given += sheet.good().kinetic_energy;
  }
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    MovingSheet& sheet = sheets[s];
    sheet.read(next[s]);
    const Drive drive{sheet.dynamics.gravity,
                      drive_speed(scene, scene.sheets[s], begin, begin + scene.solver.frame_step),
                      scene.solver.frame_step,
                      cloth_contact ? given - sheet.good().kinetic_energy : 0};
    made.sheets.push_back(
        scene.solver.max_repairs == 0
            ? inspect_finite(next[s])
            : inspect(sheet.mesh, drive, sheet.most_strain, sheet.good(), next[s]));
    if (made.reason.empty() && !made.sheets.back().reason.empty())
      made.reason = scene.sheets[s].name + ": " + made.sheets.back().reason;
  }
  if (!made.reason.empty() || !cloth_contact || scene.solver.max_repairs == 0) return made;
  if (untangling_speed(scene, begin) > 0) return made;
  if (const std::int64_t cuts = cloth_contact->first_cuts(sheets, next, pool); cuts > 0) {
    made.tangles = true;
    made.reason = std::to_string(cuts) + " cuts, where the frame began with none";
  }
  return made;
}

// Readies the sheets for what follows from an attempt.
Decision Simulation::State::repair(const Attempt& made, NextStates& next) {
  const Decision decision = repairs.judge(frame + 1, made, plan.step);
  if (decision == Decision::kAgain) {
    unfinished->substeps = 0;
    unfinished->energy = 0;
    begin_again();
  } else if (decision == Decision::kConfirmed) {
    for (std::size_t s = 0; s < sheets.size(); ++s)
      sheets[s].most_strain = std::max(sheets[s].most_strain, 2 * made.sheets[s].strain);
    restart_from(next);
  } else if (decision == Decision::kImpossible) {
    fail("computed", made.reason);
  }
  return decision;
}

// Solvers begin at the end of the last frame with the step as it now is.
void Simulation::State::begin_again() {
  for (std::size_t s = 0; s < sheets.size(); ++s)
    start(s, sheets[s].good().x, sheets[s].good().v, time());
  forget_motion();
}

// Begins a sheet with the step as it now is.
void Simulation::State::start(std::size_t sheet, const Matrix3Xd& x, const Matrix3Xd& v,
                              double time) {
  sheets[sheet].dynamics.slow_every = plan.step.slow_every;
  sheets[sheet].solver->start(x, v, time, plan.step.substep);
}

// Solvers go on from the end of the frame with the step as it now is.
void Simulation::State::restart_from(NextStates& next) {
  const double end = time() + scene.solver.frame_step;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    Matrix3Xd v;
    sheets[s].solver->closing_velocities(end, v);
    start(s, next[s].x, v, end);
    sheets[s].read(next[s]);
  }
  forget_motion();
}

// To be called where solvers start or load.
void Simulation::State::forget_motion(bool stays) {
  if (!cloth_contact) return;
  stays ? cloth_contact->forget_motion() : cloth_contact->forget();
  for (BoxEdges& edges : box_edges) edges.forget();
  for (MovingSheet& sheet : sheets) sheet.solver->measure();
}

// Halves the step from the frame's end on where energy came from nothing; false: no shorter step
// is to be had.
bool Simulation::State::keep_to_budget(NextStates& next) {
  if (scene.solver.max_repairs == 0) return true;
  const double begin = time(), frame_step = scene.solver.frame_step;
  const double led = cloth_contact ? cloth_contact->given() : 0;
  double stored = 0;
  if (cloth_contact)
    for (const MovingSheet& sheet : sheets) stored += sheet.budget.stored;
  std::string reason;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const SheetDefinition& definition = scene.sheets[s];
    const Mesh& mesh = sheets[s].mesh;
    EnergyBudget& budget = sheets[s].budget;
    const Drive drive{sheets[s].dynamics.gravity,
                      motion_speed(scene, definition, begin, begin + frame_step), frame_step};
    budget.given += work_of_motion(mesh, drive, budget.stored) + led;
    budget.substeps += plan.step.substeps;
    if (budget.substeps < kAuditSubsteps) continue;
    const std::string why = audit(mesh, drive, height_of(definition), wind_speed(scene),
                                  cloth_contact ? stored - budget.stored : 0, next[s], budget);
    if (reason.empty() && !why.empty()) reason = definition.name + ": " + why;
  }
  if (reason.empty()) return true;
  if (!repairs.keep_halved(frame + 1, reason, plan.step)) return fail("trusted", reason);
  restart_from(next);
  for (MovingSheet& sheet : sheets) sheet.budget = {};
  return true;
}

// Always false.
bool Simulation::State::fail(const char* what, const std::string& reason) {
  failure = "frame " + std::to_string(frame + 1) + " cannot be " + what + " after " +
            std::to_string(repairs.halvings()) + " halvings of the step: " + reason;
  if (cloth_contact) cloth_contact->forget();  // what it found is of that frame
  return false;
}

// Whether nothing moved in the frame being computed, no path is to come, and nothing is led apart.
bool Simulation::State::quiet(const NextStates& next) const {
  if (frame == 0 || time() + scene.solver.frame_step < rest_after) return false;
  if (cloth_contact && cloth_contact->untangles()) return false;
  const Drive drive{scene.environment.gravity, 0, scene.solver.frame_step};
  for (std::size_t s = 0; s < sheets.size(); ++s)
    if (!is_quiet(sheets[s].mesh, sheets[s].dynamics.inverse_mass, drive,
                  height_of(scene.sheets[s]), sheets[s].good(), next[s], scene.cloth_contact))
      return false;
  return true;
}

// A sheet as it is simulated, once it has a mesh.
SheetDefinition Simulation::State::simulated(std::size_t sheet) const {
  SheetDefinition definition = capped(scene, sheet);
  definition.textile.damping = sheets[sheet].mesh.damping;
  return definition;
}

Simulation::State::State(Scene given, SolverFactory factory)
    : scene(std::move(given)),
      make_solver(std::move(factory)),
      sheets(scene.sheets.begin(), scene.sheets.end()),
      bodies(scene.colliders),
      rest_after(end_of_motion(scene)),
      repairs(scene.solver) {
  std::vector<Matrix3Xd> x(sheets.size());
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const SheetDefinition definition = capped(scene, s);
    if (scene.dressing) sheets[s].dressing = dressing_at(*scene.dressing, 0);
    sheets[s].set_definition(scene, definition);
    sheets[s].bind_forces(scene);
    x[s] = start_positions(definition);
    for (const Pin& pin : definition.pins)
      for (const int i : pin.particles) x[s].col(i) += offset_at(pin.path, 0);
  }
  plan = plan_for(x);

  const double dt = plan.step.substep;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const SheetDefinition definition = simulated(s);
    Matrix3Xd v = start_velocities(definition);
    set_pin_velocities(definition.pins, 0, dt, v);
    sheets[s].solver = make_solver(scene, definition, sheets[s].mesh, sheets[s].dynamics);
    start(s, x[s], v, 0);
    sheets[s].most_strain = std::max(kMostStrain, 2 * largest_strain(sheets[s].mesh, x[s]));
  }
  make_cloth_contact();
  if (scene.cloth_contact)
    if (auto tangled = find_tangles(scene, x, at_open_seams()))
      plan.warnings.push_back(std::move(*tangled));
  forget_motion();
}

// Triangles that reach from one panel to another may start through what lies between: cloth contact
// leaves these out.
void Simulation::State::make_cloth_contact() {
  LeftOut open = at_open_seams();
  open_seams.clear();
  box_edges.clear();
  if (!scene.colliders.empty())
    for (std::size_t s = 0; s < open.size(); ++s) open_seams.emplace_back(scene.sheets[s], open[s]);
  if (!scene.cloth_contact) return;
  if (!open.empty()) open = through_cloth_at_start(scene, open);
  cloth_contact.emplace(scene, open);
  const auto is_box = [](const Collider& collider) {
    return std::holds_alternative<Box>(collider.shape);
  };
  if (std::ranges::any_of(scene.colliders, is_box))
    for (const SheetDefinition& sheet : scene.sheets) box_edges.emplace_back(sheet);
}

LeftOut Simulation::State::at_open_seams() const {
  LeftOut open;
  if (sheets.front().dressing.ease == 1) return open;
  for (const SheetDefinition& sheet : scene.sheets) open.push_back(triangles_at_open_seams(sheet));
  return open;
}

int Simulation::State::particle_count() const {
  int count = 0;
  for (const SheetDefinition& sheet : scene.sheets) count += sheet.particle_count();
  return count;
}

void Simulation::State::release_memory() {
  // solvers are beyond the last good frame
  if (!failure.empty() || unfinished) return;
  for (MovingSheet& sheet : sheets) sheet.release_memory();
  cloth_contact.reset();
  open_seams.clear();
  box_edges.clear();
  bodies.release_memory();
  released = true;
}

// Before anything but the scene, the plan and counts is looked at.
void Simulation::State::restore_memory() {
  if (!released) return;
  for (std::size_t s = 0; s < sheets.size(); ++s) sheets[s].restore_memory(scene, capped(scene, s));
  make_cloth_contact();
  released = false;
}

// x: positions of each sheet.
Plan Simulation::State::plan_for(const std::vector<Matrix3Xd>& x) const {
  std::vector<VectorXd> inverse_mass;
  for (std::size_t s = 0; s < sheets.size(); ++s) inverse_mass.push_back(planned_inverse_mass(s));
  std::vector<PlannedSheet> planned;
  planned.reserve(sheets.size());
  for (std::size_t s = 0; s < sheets.size(); ++s)
    planned.push_back({sheets[s].mesh, inverse_mass[s], x[s], sheets[s].dynamics.tethers});
  Plan made = make_plan(scene, planned);
  if (made.step.substeps <= kMaxSubsteps) repairs.shorten(made.step);
  return made;
}

std::optional<StepRefusal> Simulation::State::refusal_of(const StepPlan& step) const {
  return find_refusal(step, scene.solver, repairs.most_substeps());
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
  state_->repairs.limit_substeps(std::min(kMaxSubsteps, most / std::max(1, particle_count())));
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
  if (!state.failure.empty()) return FramePart::kFailed;
  state.restore_memory();
  return state.advance_frame(enough, pool);
}

double Simulation::frame_share() const {
  constexpr double kShareOfCoarser = 1e-3;  // has begun, and no more
  const auto& unfinished = state_->unfinished;
  if (!unfinished) return 0;
  if (unfinished->coarser) return kShareOfCoarser;
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

void Simulation::release_memory() { state_->release_memory(); }

int Simulation::most_threads() const {
  int most = 1;
  for (const MovingSheet& sheet : state_->sheets)
    most = std::max(most, sheet.solver->most_threads());
  if (state_->cloth_contact)
    most = std::max(most, static_cast<int>(state_->particle_count() / kParticlesOfShare));
  return most;
}

const std::vector<Repair>& Simulation::repairs() const { return state_->repairs.all(); }
const std::string& Simulation::failure() const { return state_->failure; }
std::optional<double> Simulation::residual() const {
  return state_->relaxation ? state_->relaxation->residual : std::nullopt;
}
std::int64_t Simulation::substeps() const { return state_->substeps; }
bool Simulation::at_rest() const { return state_->rest.at_rest(); }
bool Simulation::asleep() const { return at_rest() && !state_->scene.environment.wind; }
int Simulation::particle_count() const { return state_->particle_count(); }

}  // namespace weft

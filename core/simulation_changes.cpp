#include <algorithm>
#include <cassert>
#include <cmath>
#include <sstream>

#include "core/model/self_weight.h"
#include "core/motion/stability.h"
#include "core/simulation_state.h"

namespace weft {

// 1/kg. What is only gripped counts as free: no step is longer for that, and none shorter after it.
VectorXd Simulation::State::planned_inverse_mass(std::size_t sheet) const {
  VectorXd inverse_mass = sheets[sheet].dynamics.inverse_mass;
  for (const Grip& grip : grips)
    if (grip.sheet == sheet && !grip.pinned)
      inverse_mass[grip.particle] = 1 / sheets[sheet].mesh.mass[grip.particle];
  return inverse_mass;
}

Plan Simulation::State::plan_now() const {
  std::vector<Matrix3Xd> x;
  for (const MovingSheet& sheet : sheets) x.push_back(sheet.good().x);
  return plan_for(x);
}

SheetStates Simulation::State::closing_states() const {
  SheetStates states;
  for (const MovingSheet& sheet : sheets) {
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
    const bool keeps_pace = dt == old_dt && plan.step.slow_every == sheets[s].dynamics.slow_every;
    if (!changed[s] && keeps_pace) continue;
    start(s, states.x[s], states.v[s], time());
    sheets[s].read_good();
  }
  forget_motion(true);
}

void Simulation::State::put_textile(std::size_t sheet, const Textile& textile) {
  scene.sheets[sheet].textile = textile;
  scene_of_frame.reset();
  sheets[sheet].set_definition(scene, capped(scene, sheet));
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
  sheets[sheet].solver =
      make_solver(scene, simulated(sheet), sheets[sheet].mesh, sheets[sheet].dynamics);
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
    rest.disturb();
  }
  return true;
}

// Gives sheets what the dressing makes of them in the frame to come; false: they do not bear it.
bool Simulation::State::change_dressing() {
  if (!scene.dressing) return true;
  const DressingState next = dressing_at(*scene.dressing, time() + scene.solver.frame_step);
  if (next == sheets.front().dressing) return true;
  const double dt = plan.step.substep;
  const SheetStates before = closing_states();
  dress(next);
  if (next == DressingState())
    plan = plan_now();
  else
    shorten_step();
  if (const auto refused = refusal_of(plan.step)) {
    failure = "frame " + std::to_string(frame + 1) +
              " cannot be computed: once dressed, the sheets need " +
              std::to_string(refused->substeps) + " substeps; at most " +
              std::to_string(refused->most_substeps) + " are computed";
    return false;
  }
  restart(before, dt, std::vector<bool>(sheets.size(), true));
  rest.disturb();
  return true;
}

void Simulation::State::dress(const DressingState& state) {
  const bool was_closed = sheets.front().dressing.ease == 1;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    sheets[s].dress(scene, capped(scene, s), state);
    auto renewed = sheets[s].solver->renewed();
    sheets[s].solver = renewed
                           ? std::move(renewed)
                           : make_solver(scene, simulated(s), sheets[s].mesh, sheets[s].dynamics);
  }
  if (was_closed != (state.ease == 1)) make_cloth_contact();
}

// To what sheets of triangles bear as they are, where no step is asked for.
void Simulation::State::shorten_step() {
  if (scene.solver.substep) return;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const MovingSheet& sheet = sheets[s];
    if (sheet.mesh.surface.membrane.empty()) continue;
    StepPlan& step = plan.step;
    const double bound = linear_bound(sheet.mesh, sheet.dynamics.inverse_mass,
                                      scene.solver.integrator, 0, sheet.good().x);
    if (bound >= step.linear_bound) continue;
    const double gain = step.longest() / step.linear_bound;
    const double longest = scene.solver.safety * gain * bound;
    if (step.substep <= longest) continue;
    step.substeps = static_cast<std::int64_t>(std::ceil(scene.solver.frame_step / longest));
    step.substep = scene.solver.frame_step / static_cast<double>(step.substeps);
    step.linear_bound = bound;
    if (step.unsheared_bound > 0) step.unsheared_bound = gain * bound;
  }
}

std::optional<StepRefusal> Simulation::set_textile(std::size_t index, const Textile& textile,
                                                   double duration) {
  State& state = *state_;
  state.restore_memory();
  MovingSheet& sheet = state.sheets[index];
  const Textile now = state.scene.sheets[index].textile;
  if (!sheet.ramp && textile == now) return std::nullopt;
  const bool relaxed = state.is_relaxing();
  if (relaxed) state.set_damping(false);
  const auto refuse = [&](const StepRefusal& refused) {
    if (relaxed) state.set_damping(true);
    return refused;
  };
  const double frames = std::ceil(duration / state.scene.solver.frame_step - 1e-9);
  if (frames <= 1) {
    if (const auto refused = state.set_textile(index, textile)) return refuse(*refused);
    sheet.ramp.reset();
  } else {
    state.put_textile(index, textile);
    const Plan plan = state.plan_now();
    state.put_textile(index, now);
    if (const auto refused = state.refusal_of(plan.step)) return refuse(*refused);
    const std::int64_t begin = state.frame;
    sheet.ramp = {now, textile, begin, begin + static_cast<std::int64_t>(frames)};
  }
  state.disturb(false);
  return std::nullopt;
}

const Textile& Simulation::target_textile(std::size_t index) const {
  const auto& ramp = state_->sheets[index].ramp;
  return ramp ? ramp->to : state_->scene.sheets[index].textile;
}

bool Simulation::textile_changed() const { return state_->textile_changed; }

Constraints Simulation::State::constraints() const {
  Constraints constraints{{}, {}, {}, grips};
  for (const SheetDefinition& sheet : scene.sheets) constraints.pins.push_back(sheet.pins);
  for (const Collider& collider : scene.colliders) {
    constraints.paths.push_back(collider.path);
    constraints.leads.push_back(collider.lead);
  }
  return constraints;
}

void Simulation::State::adopt(Constraints constraints) {
  scene_of_frame.reset();
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    scene.sheets[s].pins = std::move(constraints.pins[s]);
    sheets[s].set_pins(scene.sheets[s]);
  }
  for (std::size_t c = 0; c < scene.colliders.size(); ++c) {
    scene.colliders[c].path = std::move(constraints.paths[c]);
    scene.colliders[c].lead = constraints.leads[c];
  }
  grips = std::move(constraints.grips);
  rest_after = end_of_motion(scene);
}

// Something was done to it. Where it relaxed, sheets have the damping of their textiles again.
void Simulation::State::disturb(bool relaxes) {
  rest.disturb();
  if (is_relaxing()) {
    const SheetStates states = closing_states();
    make_solvers();
    restart(states, plan.step.substep, std::vector<bool>(sheets.size(), true));
  }
  relaxation.reset();
  if (relaxes) relaxation.emplace();
}

ActionContext Simulation::State::action_context() const {
  return {scene, time(), [this](std::size_t s, int i) { return sheets[s].start(i); },
          [this](std::size_t s, int i) { return sheets[s].good().x.col(i); }};
}

Constraints Simulation::constraints() const { return state_->constraints(); }

std::vector<Problem> Simulation::problems_of(const std::vector<Action>& actions) const {
  state_->restore_memory();
  Constraints after = constraints();
  return apply(actions, state_->action_context(), after);
}

namespace {

bool asks_to_relax(const std::vector<Action>& actions) {
  return std::any_of(actions.begin(), actions.end(),
                     [](const Action& action) { return action.kind == Action::Kind::kRelax; });
}

}  // namespace

std::optional<StepRefusal> Simulation::act(const std::vector<Action>& actions) {
  State& state = *state_;
  state.restore_memory();
  const bool relaxed = state.is_relaxing();
  if (relaxed) state.set_damping(false);
  const Constraints before = constraints();
  Constraints after = before;
  [[maybe_unused]] const auto problems = apply(actions, state.action_context(), after);
  assert(problems.empty());
  if (hold_the_same(before, after)) {
    state.adopt(std::move(after));
    state.disturb(asks_to_relax(actions));
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
      if (relaxed) state.set_damping(true);
      return refused;
    }
    state.plan = std::move(plan);
  }
  for (std::size_t s = 0; s < state.sheets.size(); ++s)
    set_pin_velocities(state.scene.sheets[s].pins, state.time(), state.plan.step.substep,
                       states.v[s]);
  state.restart(states, dt, changed);
  state.disturb(asks_to_relax(actions));
  return std::nullopt;
}

}  // namespace weft

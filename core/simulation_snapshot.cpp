#include <algorithm>
#include <cassert>

#include "core/simulation_state.h"

namespace weft {

Snapshot Simulation::snapshot() const {
  state_->restore_memory();
  return state_->snapshot();
}

Snapshot Simulation::State::snapshot() const {
  assert(failure.empty() && !unfinished);
  Snapshot snapshot{frame,         substeps, rest.frames(), repairs.halvings(), plan,
                    repairs.all(), {},       constraints(), relaxation};
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const MovingSheet& sheet = sheets[s];
    snapshot.sheets.push_back({scene.sheets[s].textile, sheet.most_strain, sheet.good().x,
                               sheet.good().v, sheet.solver->save(), sheet.ramp, sheet.budget});
  }
  return snapshot;
}

bool Simulation::restore(const Snapshot& snapshot) {
  if (!fits(state_->scene, snapshot)) return false;
  Scene scene = state_->scene;
  for (std::size_t s = 0; s < scene.sheets.size(); ++s) {
    scene.sheets[s].textile = snapshot.sheets[s].textile;
    scene.sheets[s].pins = snapshot.constraints.pins[s];
  }
  for (std::size_t c = 0; c < scene.colliders.size(); ++c) {
    scene.colliders[c].path = snapshot.constraints.paths[c];
    scene.colliders[c].lead = snapshot.constraints.leads[c];
  }
  if (!find_problems(scene).empty()) return false;
  auto restored = std::make_unique<State>(std::move(scene), state_->make_solver);
  restored->repairs.limit_substeps(state_->repairs.most_substeps());
  if (!restored->adopt(snapshot)) return false;
  state_ = std::move(restored);
  return true;
}

// Precondition: what was taken since has changed nothing but textiles that ramp.
void Simulation::State::go_back_to(const Snapshot& before) {
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    if (scene.sheets[s].textile == before.sheets[s].textile) continue;
    put_textile(s, before.sheets[s].textile);
    sheets[s].solver = make_solver(scene, simulated(s), sheets[s].mesh, sheets[s].dynamics);
  }
  [[maybe_unused]] const bool taken = adopt(before);
  assert(taken);
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const Snapshot::Sheet& saved = before.sheets[s];
    SheetState good{saved.x, saved.v, weft::kinetic_energy(sheets[s].mesh, saved.v)};
    sheets[s].set_good(good);
  }
}

// False where a solver saved something else.
bool Simulation::State::adopt(const Snapshot& snapshot) {
  frame = snapshot.frame;
  rest.adopt(snapshot.frames_at_rest);
  substeps = snapshot.substeps;
  repairs.adopt(snapshot.halvings, snapshot.repairs);
  plan = snapshot.plan;
  grips = snapshot.constraints.grips;
  relaxation = snapshot.relaxation;
  if (scene.dressing)
    if (const DressingState then = dressing_at(*scene.dressing, time());
        then != sheets.front().dressing)
      dress(then);
  const auto has_less = [](const MovingSheet& sheet) {
    return sheet.damping_in_motion.has_value();
  };
  if (is_relaxing() != std::any_of(sheets.begin(), sheets.end(), has_less)) {
    set_damping(is_relaxing());
    make_solvers();
  }
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    MovingSheet& sheet = sheets[s];
    const Snapshot::Sheet& saved = snapshot.sheets[s];
    sheet.most_strain = saved.most_strain;
    sheet.ramp = saved.ramp;
    sheet.budget = saved.budget;
    start(s, saved.x, saved.v, time());
    if (!sheet.solver->load(saved.solver)) return false;
  }
  forget_motion();
  return true;
}

}  // namespace weft

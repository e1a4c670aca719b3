#include <algorithm>
#include <cmath>
#include <utility>

#include "core/forces/elastic.h"
#include "core/lattice/coarser.h"
#include "core/lattice/lattice.h"
#include "core/lattice/shown.h"
#include "core/model/strain.h"
#include "core/simulation_state.h"

namespace weft {

// Once nothing moves the scene but its forces.
bool Simulation::State::begins_to_relax() const {
  constexpr double kRounding = 1e-9;
  const auto changes = [](const MovingSheet& sheet) { return sheet.ramp.has_value(); };
  return relaxation && !relaxation->begun && time() >= rest_after - kRounding &&
         std::none_of(sheets.begin(), sheets.end(), changes);
}

// Begins where this one stands; none: it relaxes by itself.
std::unique_ptr<Simulation> Simulation::State::coarser_simulation() const {
  std::vector<Matrix3Xd> x;
  for (const MovingSheet& sheet : sheets) x.push_back(sheet.good().x);
  auto coarser = coarser_scene(scene, x, time());
  if (!coarser || !find_problems(*coarser).empty()) return nullptr;
  auto made = std::make_unique<Simulation>(std::move(*coarser), make_solver);
  if (made->refusal() || made->act({{.kind = Action::Kind::kRelax}})) return nullptr;
  return made;
}

// Brings fewer particles to rest first, and moves the sheets as far as those came. False: they are
// not yet there, and it is enough.
bool Simulation::State::relax_coarser(const Enough& enough, ThreadPool& pool) {
  constexpr std::int64_t kMostFrames = 600;
  if (!begins_to_relax()) return true;
  const auto& coarser = unfinished->coarser;
  if (coarser) {
    while (!coarser->at_rest() && coarser->frame() < kMostFrames) {
      const FramePart part = coarser->advance_frame(enough, pool);
      if (part == FramePart::kUnfinished) return false;
      if (part == FramePart::kFailed) break;
      if (enough && enough()) return false;
    }
  }
  set_damping(true);
  make_solvers();
  NextStates begin(sheets.size());
  Eigen::Index first = 0;
  std::vector<double> all(coarser ? 3 * static_cast<std::size_t>(coarser->particle_count()) : 0);
  if (coarser) coarser->copy_positions(all);
  const auto planes = Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>>(
      all.data(), 3, static_cast<Eigen::Index>(all.size() / 3));
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    begin[s].x = sheets[s].good().x;
    if (!coarser || !coarser->failure().empty()) continue;
    const SheetDefinition& coarse = coarser->scene().sheets[s];
    const Matrix3Xd there = planes.middleCols(first, coarse.particle_count());
    first += there.cols();
    const Matrix3Xd way =
        resample(there - start_positions(coarse), grid_of(coarse), grid_of(scene.sheets[s]));
    for (Eigen::Index i = 0; i < way.cols(); ++i)
      if (sheets[s].dynamics.inverse_mass[i] > 0) begin[s].x.col(i) += way.col(i);
  }
  stand_still(time(), begin);
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    sheets[s].most_strain =
        std::max(sheets[s].most_strain, 2 * largest_strain(sheets[s].mesh, begin[s].x));
    sheets[s].set_good(begin[s]);
    sheets[s].budget = {};
  }
  constexpr int kSettling = 2;
  if (coarser) relaxation->settling = kSettling;
  unfinished->coarser.reset();
  relaxation->begun = true;
  return true;
}

// Amid a frame.
void Simulation::State::settle(double time) {
  NextStates now(sheets.size());
  double energy = 0;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    sheets[s].read(now[s]);
    energy += now[s].kinetic_energy;
  }
  const bool slows_down = energy < unfinished->energy;
  if (slows_down) stand_still(time, now);
  unfinished->energy = slows_down ? 0 : energy;
}

bool Simulation::State::is_relaxing() const {
  return relaxation && relaxation->begun && !relaxation->ended;
}

// With little damping sheets come to rest soonest: what damps fast modes holds up slow ones.
// Solvers are then to be made anew.
void Simulation::State::set_damping(bool relaxes) {
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    MovingSheet& sheet = sheets[s];
    double& damping = sheet.mesh.damping;
    if (relaxes && damping > 0) {
      sheet.damping_in_motion = damping;
      damping *= std::min(1.0, 2 * kSafeDampingRatio / plan.dampings[s].ratio);
    } else if (!relaxes && sheet.damping_in_motion) {
      damping = *std::exchange(sheet.damping_in_motion, std::nullopt);
    }
  }
}

void Simulation::State::make_solvers() {
  for (std::size_t s = 0; s < sheets.size(); ++s)
    sheets[s].solver = make_solver(scene, simulated(s), sheets[s].mesh, sheets[s].dynamics);
}

// Solvers go on from where the sheets are, at `time`, without motion.
void Simulation::State::stand_still(double time, NextStates& next) {
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    next[s].v = Matrix3Xd::Zero(3, next[s].x.cols());
    next[s].kinetic_energy = 0;
    start(s, next[s].x, next[s].v, time);
  }
  forget_motion();
}

MeanMotion Simulation::State::mean_motion(const NextStates& next) const {
  const double frame_step = scene.solver.frame_step, given = scene.environment.gravity.norm();
  MeanMotion motion;
  double squares = 0;
  int free = 0;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const MovingSheet& sheet = sheets[s];
    for (Eigen::Index i = 0; i < next[s].x.cols(); ++i) {
      if (sheet.dynamics.inverse_mass[i] == 0) continue;
      const double square = (next[s].x.col(i) - sheet.good().x.col(i)).squaredNorm();
      motion.energy += sheet.mesh.mass[i] / 2 * square / (frame_step * frame_step);
      squares += square;
      ++free;
    }
  }
  if (free == 0) return motion;
  // x = a t^2 / 2
  motion.acceleration = 2 * std::sqrt(squares / free) / (frame_step * frame_step) /
                        (given > 0 ? given : kStandardGravity);
  return motion;
}

// At the end of a frame.
void Simulation::State::relax(bool quiet, NextStates& next) {
  const Relaxation::Next then = relaxation->look(mean_motion(next), quiet);
  if (then == Relaxation::Next::kMoveOn) return;
  if (then == Relaxation::Next::kRest) {
    rest.settle();
    set_damping(false);
    make_solvers();
  }
  stand_still(time() + scene.solver.frame_step, next);
}

}  // namespace weft

#include "core/lattice/solver.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/lattice/contact.h"
#include "core/lattice/law.h"
#include "core/lattice/tethers.h"
#include "core/motion/gaps.h"
#include "core/motion/saved_values.h"
#include "core/motion/step_motion.h"

namespace weft {
namespace {

template <class T>
class LatticeSolver : public SheetSolver {
 public:
  LatticeSolver(const SheetDefinition& sheet, const Dynamics& dynamics,
                const std::optional<Wind>& wind, bool compensated, IntegratorKind integrator)
      : dynamics_(dynamics),
        columns_(grid_of(sheet).columns),
        particles_(sheet.particle_count()),
        damping_(sheet.textile.damping.value_or(kDefaultDamping)),
        law_(make_sweep_law<T>(sheet)),
        state_(law_.layout, compensated, static_cast<T>(lead_of(integrator))),
        gaps_(static_cast<std::size_t>(law_.layout.rows), 1) {
    law_.compensated = compensated;
    if (wind) law_.wind = wind_ = make_wind_law<T>(*wind);
  }

  void start(const Matrix3Xd& x, const Matrix3Xd& v, double time, double dt) override {
    dt_ = dt;
    if (law_.compensated && !std::exchange(started_, true)) {
      // one after the other: reductions add in an order that depends on where origin_ lies
      for (const auto& position : x.colwise()) origin_ += position;
      origin_ /= particles_;
    }
    law_.damping = static_cast<T>(damping_ / (2 * dt));
    law_.wind.to_velocity = static_cast<T>(1 / (6 * dt));
    drag_rate_ = dynamics_.drag.size() > 0 ? drag_rate() : 0;
    set_slow(1);
    // half a kick: x(-dt) = x - v dt + a dt^2 / 2
    Matrix3Xd a;
    accelerate(dynamics_, time, x, v, a);
    for_each_particle([&](int i, Place at) {
      set_position(at, x.col(i));
      const Vector3d d = v.col(i) * dt - a.col(i) * (dt * dt / 2);
      set_displacement(at, d);
      const Vector3d w = state_.lead() == 2 ? Vector3d(2 * d) : Vector3d(v.col(i) * 2 * dt);
      for (int axis = 0; axis < 3; ++axis) at[State::kW + axis] = static_cast<T>(w[axis]);
      at[State::kStep2] = static_cast<T>(dynamics_.inverse_mass[i] * dt * dt);
    });
    tethers_ = {dynamics_.tethers, law_.layout};
    held_moved_ = true;
    gaps_.forget();
    motion_.start();
  }

  void advance(double time, int slow, ThreadPool& pool) override {
    if (static_cast<T>(slow) != law_.slow) set_slow(slow);
    Vector3d drift = dynamics_.gravity * (dt_ * dt_);
    if (law_.drag > 0) drift += slow * drag_rate_ * dt_ * dt_ * dynamics_.air(time);
    const Vector3d air = law_.wind.blows ? dynamics_.air(time) : Vector3d(Vector3d::Zero());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      law_.drift[axis] = static_cast<T>(drift[static_cast<Eigen::Index>(axis)]);
      law_.wind.velocity[axis] = static_cast<T>(air[static_cast<Eigen::Index>(axis)]);
    }
    motion_.step(sweep(law_, state_, bands(pool), pool));
  }

  void move_held(int particle, const Vector3d& x, const Vector3d& d) override {
    const Place at = state_.place(particle / columns_, particle % columns_);
    motion_.hold(d, displacement(at));
    set_position(at, x);
    for (int axis = 0; axis < 3; ++axis)
      at[State::kW + axis] =
          static_cast<T>(state_.lead() * d[axis]) - (state_.lead() - 2) * at[State::kD + axis];
    set_displacement(at, d);
    held_moved_ = true;
  }

  void pull_back(ThreadPool& pool) override {
    if (std::exchange(held_moved_, false)) tethers_.read_ends(state_);
    const auto pull = [&](int first, int last) {
      return pull_back_rows(tethers_, static_cast<T>(kInward * dt_), law_.compensated, first, last,
                            state_);
    };
    const int rows = law_.layout.rows, shares = bands(pool);
    if (shares == 1) {
      motion_.pull_back(pull(0, rows), dynamics_.tethers.size());
      return;
    }
    std::vector<T> back(static_cast<std::size_t>(shares));
    pool.run(shares, [&](int share) {
      back[static_cast<std::size_t>(share)] =
          pull(rows * share / shares, rows * (share + 1) / shares);
    });
    motion_.pull_back(*std::max_element(back.begin(), back.end()), dynamics_.tethers.size());
  }

  void resolve(const Contacts& contacts, ThreadPool& pool) override {
    law_.measured = true;
    const bool may_cross = contacts.may_cross(motion_.moved());
    if (contacts.first_grid() != nullptr) {
      constexpr std::size_t kGroups = LatticeLayout<T>::kLanes / KnownCells::kParticles;
      known_.resize(static_cast<std::size_t>(law_.layout.rows * state_.vectors()) * kGroups);
    }
    gaps_.look(motion_.moved() + contacts.reach(), bands(pool), pool, [&](int row) {
      const Resolved resolved =
          may_cross ? resolve_in_parts(contacts, row)
                    : resolve_row(contacts, origin_, law_.compensated, row, known_, state_);
      motion_.push(row, resolved.moved, resolved.changed);
      return resolved.gap;
    });
    motion_.pushed(gaps_.looked_at());
  }

  void measure() override {
    law_.measured = law_.changes = true;
    motion_.measure(gaps_.parts());
  }
  double moved() const override { return motion_.moved(); }
  double pushed() const override { return motion_.pushed(); }
  double take_change() override { return motion_.take_change(); }
  void read(std::span<const int> particles, Eigen::Ref<Matrix3Xd> x,
            Eigen::Ref<Matrix3Xd> d) const override {
    for (Eigen::Index k = 0; const int i : particles) {
      const ConstPlace at = state_.place(i / columns_, i % columns_);
      x.col(k) = position(at);
      d.col(k++) = displacement(at);
    }
  }
  void displace(std::span<const int> particles, const Eigen::Ref<const Matrix3Xd>& by,
                const Eigen::Ref<const Matrix3Xd>& in_step) override {
    motion_.displace(by, in_step);
    for (Eigen::Index k = 0; const int i : particles) {
      const Place at = state_.place(i / columns_, i % columns_);
      set_position(at, position(at) + by.col(k));
      set_displacement(at, displacement(at) + in_step.col(k));
      for (int axis = 0; axis < 3; ++axis)
        at[State::kW + axis] += static_cast<T>(state_.lead() * in_step(axis, k));
      ++k;
    }
  }

  // Smaller bands cost more to share than they take.
  int most_threads() const override {
    constexpr int kParticles = 4096, kRows = 16;
    return std::max(1, std::min(particles_ / kParticles, law_.layout.rows / kRows));
  }

  void release_memory() override {
    state_.release_memory();
    known_ = {};
    tethers_ = {};
  }
  void restore_memory() override {
    tethers_ = {dynamics_.tethers, law_.layout};
    held_moved_ = true;
  }

  void positions(Matrix3Xd& x) const override {
    x.resize(3, particles_);
    for_each_particle([&](int i, ConstPlace at) { x.col(i) = position(at); });
  }
  void velocities(Matrix3Xd& v) const override {
    v.resize(3, particles_);
    const double scale = 1 / (2 * dt_);
    for_each_particle([&](int i, ConstPlace at) {
      for (int axis = 0; axis < 3; ++axis) v(axis, i) = scale * double{at[State::kW + axis]};
    });
  }
  // v = d / dt + a dt / 2: d stands for the velocity half a step ago
  void closing_velocities(double time, Matrix3Xd& v) const override {
    Matrix3Xd x, a;
    positions(x);
    velocities(v);
    accelerate(dynamics_, time, x, v, a);
    for_each_particle([&](int i, ConstPlace at) {
      for (int axis = 0; axis < 3; ++axis)
        v(axis, i) =
            exact(State::kD + axis, State::kDError + axis, at) / dt_ + a(axis, i) * (dt_ / 2);
    });
  }

  std::string save() const override {
    SavedValues saved;
    saved.put(kind());
    saved.put(origin_.data(), 3);
    saved.put(law_.measured ? 1 : 0);
    gaps_.save(saved);
    for (int plane = 0; plane < state_.planes(); ++plane)
      for_each_particle([&](int, ConstPlace at) { saved.put(at[plane]); });
    return saved.bytes();
  }
  bool load(const std::string& saved) override {
    LoadedValues loaded(saved);
    int saved_kind = 0, measured = 0;
    loaded.take(&saved_kind, 1);
    if (saved_kind != kind()) return false;
    loaded.take(origin_.data(), 3);
    loaded.take(&measured, 1);
    law_.measured = measured != 0;
    gaps_.load(loaded);
    held_moved_ = true;
    for (int plane = 0; plane < state_.planes(); ++plane)
      for_each_particle([&](int, Place at) { loaded.take(&at[plane], 1); });
    return loaded.all_taken();
  }

 private:
  using State = SweepState<T>;

  // What planes are saved.
  int kind() const { return 16 * state_.planes() + static_cast<int>(sizeof(T)); }

  int bands(const ThreadPool& pool) const { return std::min(pool.threads(), most_threads()); }

  void set_slow(int slow) {
    law_.slow = static_cast<T>(slow);
    law_.wind.blows = wind_.blows && slow > 0;
    if (wind_.blows) law_.wind.set_strength(wind_, slow, give_of(dynamics_, slow, dt_));
    law_.drag = static_cast<T>(slow * drag_rate_ * dt_);
    law_.drag_share = T(1) / (T(1) + law_.drag / 2);
  }

  using Place = typename State::Place;
  using ConstPlace = typename State::ConstPlace;
  template <class F>
  void for_each_particle(const F& f) {
    visit(state_, f);
  }
  template <class F>
  void for_each_particle(const F& f) const {
    visit(state_, f);
  }
  template <class S, class F>
  void visit(S& state, const F& f) const {
    for (int r = 0, i = 0; r < law_.layout.rows; ++r)
      for (int c = 0; c < columns_; ++c, ++i) f(i, state.place(r, c));
  }

  template <class P>
  double exact(int plane, int error, P at) const {
    return law_.compensated ? at[plane] - double{at[error]} : at[plane];
  }
  template <class P>
  Vector3d position(P at) const {
    Vector3d x;
    for (int axis = 0; axis < 3; ++axis)
      x[axis] = origin_[axis] + exact(State::kX + axis, State::kXError + axis, at);
    return x;
  }
  template <class P>
  Vector3d displacement(P at) const {
    Vector3d d;
    for (int axis = 0; axis < 3; ++axis)
      d[axis] = exact(State::kD + axis, State::kDError + axis, at);
    return d;
  }
  void set(int plane, int error, Place at, const Vector3d& exact) {
    for (int axis = 0; axis < 3; ++axis) {
      const T rounded = at[plane + axis] = static_cast<T>(exact[axis]);
      if (law_.compensated) at[error + axis] = static_cast<T>(double{rounded} - exact[axis]);
    }
  }
  void set_position(Place at, const Vector3d& x) {
    set(State::kX, State::kXError, at, x - origin_);
  }
  void set_displacement(Place at, const Vector3d& d) { set(State::kD, State::kDError, at, d); }

  // As resolve_row(), where particles may come through colliders unseen.
  Resolved resolve_in_parts(const Contacts& contacts, int row) {
    Resolved resolved;
    for (int c = 0; c < columns_; ++c) {
      const Place at = state_.place(row, c);
      if (at[State::kStep2] == 0) continue;
      Vector3d x = position(at), d = displacement(at);
      const Vector3d from = x, before = d;
      if (contacts.resolve(x, d)) {
        set_position(at, x);
        set_displacement(at, d);
        for (int axis = 0; axis < 3; ++axis)
          at[State::kW + axis] += static_cast<T>(state_.lead() * (d[axis] - before[axis]));
        resolved.move((position(at) - from).norm(), (displacement(at) - before).norm());
      }
      resolved.gap = std::min(resolved.gap, contacts.gap(x));
    }
    return resolved;
  }

  // Drag over mass is one for all particles: both go by area, 1/s.
  double drag_rate() const {
    Eigen::Index i = 0;
    const double inverse_mass = dynamics_.inverse_mass.maxCoeff(&i);
    return dynamics_.drag[i] * inverse_mass;
  }

  const Dynamics& dynamics_;
  int columns_, particles_;
  double damping_, dt_ = 0;
  double drag_rate_ = 0;  // 1/s
  SweepLaw<T> law_;
  WindLaw<T> wind_;
  State state_;
  LatticeTethers<T> tethers_;
  bool held_moved_ = true;  // since the ends of tethers were read
  bool started_ = false;
  Vector3d origin_ = Vector3d::Zero();  // that x is relative to, m
  StepMotion motion_;
  std::vector<KnownCells> known_;  // of groups of lanes, where the first collider has a grid
  Gaps gaps_;                      // of rows
};

}  // namespace

std::unique_ptr<SheetSolver> make_lattice_solver(const SheetDefinition& sheet,
                                                 const Dynamics& dynamics,
                                                 const std::optional<Wind>& wind,
                                                 const SolverSettings& settings) {
  if (settings.precision == Precision::kDouble)
    return std::make_unique<LatticeSolver<double>>(sheet, dynamics, wind, false,
                                                   settings.integrator);
  return std::make_unique<LatticeSolver<float>>(sheet, dynamics, wind, settings.compensated,
                                                settings.integrator);
}

}  // namespace weft

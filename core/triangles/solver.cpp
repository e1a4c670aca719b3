#include "core/triangles/solver.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/forces/hinges.h"
#include "core/motion/gaps.h"
#include "core/motion/saved_values.h"
#include "core/motion/step_motion.h"
#include "core/triangles/contact.h"
#include "core/triangles/law.h"
#include "core/triangles/sweep.h"

namespace weft {
namespace {

template <class T>
class TriangleSolver : public SheetSolver {
 public:
  TriangleSolver(const Mesh& mesh, const Dynamics& dynamics, const WindLaw<T>& wind,
                 bool compensated, IntegratorKind integrator, TriangleLaw<T> law)
      : mesh_(mesh),
        dynamics_(dynamics),
        integrator_(integrator),
        particles_(static_cast<int>(mesh.mass.size())),
        law_(std::move(law)),
        wind_(wind),
        state_(particles_, compensated, static_cast<T>(lead_of(integrator))),
        gaps_(static_cast<std::size_t>(law_.blocks()) * kRunsOfBlock, kRunsOfBlock) {
    law_.compensated = compensated;
    law_.drags = dynamics.drag.size() > 0;
    law_.measured = law_.changes = false;
    law_.wind = wind;
    state_.prepare(law_);
    if (!mesh.surface.hinges.empty()) find_hinged();
  }

  void start(const Matrix3Xd& x, const Matrix3Xd& v, double time, double dt) override {
    dt_ = dt;
    if (law_.compensated && !std::exchange(started_, true)) {
      // one after the other: reductions add in an order that depends on where origin_ lies
      for (const auto& position : x.colwise()) origin_ += position;
      origin_ /= particles_;
    }
    set_step();
    set_slow(1);
    // half a kick: x(-dt) = x - v dt + a dt^2 / 2
    Matrix3Xd a;
    accelerate(dynamics_, time, x, v, a);
    for (int i = 0; i < particles_; ++i) {
      set(state_.x, state_.x_error, i, x.col(i) - origin_);
      const Vector3d d = v.col(i) * dt - a.col(i) * (dt * dt / 2);
      set(state_.d, state_.d_error, i, d);
      put(state_.w, i, state_.lead == 2 ? Vector3d(2 * d) : Vector3d(v.col(i) * (2 * dt)));
    }
    gaps_.forget();
    motion_.start();
  }

  void advance(double time, int slow, ThreadPool& pool) override {
    if (static_cast<T>(slow) != law_.slow) set_slow(slow);
    const bool airy = slow > 0 && (law_.drags || law_.wind.blows);
    const Vector3d air = airy ? dynamics_.air(time) : Vector3d(Vector3d::Zero());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double speed = air[static_cast<Eigen::Index>(axis)];
      law_.drift[axis] =
          static_cast<T>(dynamics_.gravity[static_cast<Eigen::Index>(axis)] * (dt_ * dt_));
      law_.air[axis] = static_cast<T>(speed * dt_);
      law_.wind.velocity[axis] = static_cast<T>(speed);
    }
    if (!hinges_.empty()) turn_hinges();
    motion_.step(sweep(law_, state_, bands(pool), pool));
  }

  void move_held(int particle, const Vector3d& x, const Vector3d& d) override {
    set(state_.x, state_.x_error, particle, x - origin_);
    const std::size_t at = place(particle);
    motion_.hold(d, exact(state_.d, state_.d_error, at));
    for (std::size_t axis = 0; axis < 3; ++axis)
      state_.w.data()[at + axis] =
          static_cast<T>(state_.lead * d[static_cast<Eigen::Index>(axis)]) -
          (state_.lead - 2) * state_.d.data()[at + axis];
    set(state_.d, state_.d_error, particle, d);
  }

  void pull_back(ThreadPool& /*pool*/) override {
    const auto get = [&](int i) {
      return Moved{position_at(place(i)), exact(state_.d, state_.d_error, place(i))};
    };
    const auto put = [&](int i, const Moved& to) {
      add(i, to.x - position_at(place(i)), to.d - exact(state_.d, state_.d_error, place(i)));
    };
    motion_.pull_back(weft::pull_back(dynamics_.tethers, kInward * dt_, get, put),
                      dynamics_.tethers.size());
  }

  void resolve(const Contacts& contacts, ThreadPool& pool) override {
    law_.measured = true;
    const bool may_cross = contacts.may_cross(motion_.moved());
    if (contacts.first_grid() != nullptr) known_.resize(gaps_.parts());
    gaps_.look(motion_.moved() + contacts.reach(), bands(pool), pool, [&](int run) {
      const Resolved resolved =
          may_cross ? resolve_in_parts(contacts, run)
                    : resolve_run(contacts, origin_, law_.compensated, run, known_, state_);
      motion_.push(run, resolved.moved, resolved.changed);
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
    read(particles, state_.x, state_.x_error, x);
    x.colwise() += origin_;
    read(particles, state_.d, state_.d_error, d);
  }
  void displace(std::span<const int> particles, const Eigen::Ref<const Matrix3Xd>& by,
                const Eigen::Ref<const Matrix3Xd>& in_step) override {
    motion_.displace(by, in_step);
    for (Eigen::Index k = 0; const int i : particles) {
      add(i, by.col(k), in_step.col(k));
      ++k;
    }
  }

  // Smaller shares cost more to share than they take.
  int most_threads() const override {
    constexpr int kParticles = 2048;
    return std::max(1, particles_ / kParticles);
  }

  std::unique_ptr<SheetSolver> renewed() override {
    if (law_.released()) return nullptr;
    law_.set_constants(mesh_);
    return std::make_unique<TriangleSolver>(mesh_, dynamics_, wind_, law_.compensated, integrator_,
                                            std::move(law_));
  }

  void release_memory() override {
    state_.release_memory();
    known_ = {};
    law_.release();
  }
  void restore_memory() override {
    if (!law_.released()) return;
    state_.prepare(law_);
    set_step();
    law_.restore(mesh_);
  }

  void positions(Matrix3Xd& x) const override {
    x.resize(3, particles_);
    for (int i = 0; i < particles_; ++i) x.col(i) = position_at(place(i));
  }
  void velocities(Matrix3Xd& v) const override {
    v.resize(3, particles_);
    const double scale = 1 / (2 * dt_);
    for (int i = 0; i < particles_; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis)
        v(static_cast<Eigen::Index>(axis), i) = scale * double{state_.w.data()[place(i) + axis]};
  }
  // v = d / dt + a dt / 2: d stands for the velocity half a step ago
  void closing_velocities(double time, Matrix3Xd& v) const override {
    Matrix3Xd x, a;
    positions(x);
    velocities(v);
    accelerate(dynamics_, time, x, v, a);
    for (int i = 0; i < particles_; ++i)
      v.col(i) = exact(state_.d, state_.d_error, place(i)) / dt_ + a.col(i) * (dt_ / 2);
  }

  std::string save() const override {
    SavedValues saved;
    saved.put(kind());
    saved.put(origin_.data(), 3);
    saved.put(law_.measured ? 1 : 0);
    gaps_.save(saved);
    for (const AlignedArray<T>* plane : {&state_.x, &state_.w, &state_.d, &state_.step2,
                                         &state_.drag, &state_.x_error, &state_.d_error})
      saved.put(plane->data(), plane->size());
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
    for (AlignedArray<T>* plane : {&state_.x, &state_.w, &state_.d, &state_.step2, &state_.drag,
                                   &state_.x_error, &state_.d_error})
      loaded.take(plane->data(), plane->size());
    return loaded.all_taken();
  }

 private:
  static constexpr std::size_t kRunsOfBlock = TriangleLaw<T>::kBlock / kContactRun;

  // What planes are saved; no kind of a lattice's.
  int kind() const {
    return 1 << 16 | law_.drags << 5 | law_.compensated << 4 | static_cast<int>(sizeof(T));
  }

  int bands(const ThreadPool& pool) const { return std::min(pool.threads(), most_threads()); }

  // What depends on the length of a step.
  void set_step() {
    law_.damping = static_cast<T>(mesh_.damping / (2 * dt_));
    law_.wind.to_velocity = static_cast<T>(1 / (6 * dt_));
    for (int i = 0; i < particles_; ++i) {
      const double inverse_mass = dynamics_.inverse_mass[i];
      put(state_.step2, i, Vector3d::Constant(inverse_mass * dt_ * dt_));
      if (law_.drags)
        put(state_.drag, i, Vector3d::Constant(dynamics_.drag[i] * inverse_mass * dt_));
    }
  }

  void set_slow(int slow) {
    law_.slow = static_cast<T>(slow);
    if (wind_.blows) law_.wind.set_strength(wind_, slow, give_of(dynamics_, slow, dt_));
  }

  // Numbers the particles of hinges apart.
  void find_hinged() {
    state_.turn = AlignedArray<T>(state_.size());
    hinges_ = mesh_.surface.hinges;
    for (const Hinge& hinge : hinges_)
      hinged_.insert(hinged_.end(), hinge.particle.begin(), hinge.particle.end());
    std::sort(hinged_.begin(), hinged_.end());
    hinged_.erase(std::unique(hinged_.begin(), hinged_.end()), hinged_.end());
    for (Hinge& hinge : hinges_)
      for (int& i : hinge.particle)
        i = static_cast<int>(std::lower_bound(hinged_.begin(), hinged_.end(), i) - hinged_.begin());
    hinged_x_.resize(3, static_cast<Eigen::Index>(hinged_.size()));
  }
  void turn_hinges() {
    for (Eigen::Index k = 0; const int i : hinged_) hinged_x_.col(k++) = position_at(place(i));
    hinged_force_.setZero(3, hinged_x_.cols());
    add_hinge_forces(hinges_, hinged_x_, hinged_force_);
    for (Eigen::Index k = 0; const int i : hinged_) put(state_.turn, i, hinged_force_.col(k++));
  }

  // Where the values of a particle begin.
  std::size_t place(int particle) const {
    return 4 * static_cast<std::size_t>(law_.place[static_cast<std::size_t>(particle)]);
  }

  Vector3d exact(const AlignedArray<T>& plane, const AlignedArray<T>& error, std::size_t at) const {
    using Four = Eigen::Array<T, 4, 1>;
    Eigen::Array4d v = Four::Map(plane.data() + at).template cast<double>();
    if (law_.compensated) v -= Four::Map(error.data() + at).template cast<double>();
    return v.head<3>();
  }
  void read(std::span<const int> particles, const AlignedArray<T>& plane,
            const AlignedArray<T>& error, Eigen::Ref<Matrix3Xd> to) const {
    using Four = Eigen::Array<T, 4, 1>;
    const T *values = plane.data(), *errors = law_.compensated ? error.data() : nullptr;
    const int* places = law_.place.data();
    double* out = to.data();
    const std::ptrdiff_t stride = to.outerStride();
    for (const int i : particles) {
      const std::ptrdiff_t at = std::ptrdiff_t{4} * places[i];
      Eigen::Array4d v = Four::Map(values + at).template cast<double>();
      if (errors != nullptr) v -= Four::Map(errors + at).template cast<double>();
      Eigen::Map<Vector3d>{out} = v.template head<3>();
      out += stride;
    }
  }
  Vector3d position_at(std::size_t at) const {
    return origin_ + exact(state_.x, state_.x_error, at);
  }
  void set(AlignedArray<T>& plane, AlignedArray<T>& error, int particle, const Vector3d& exact) {
    set_at(plane, error, place(particle), exact);
  }
  void set_at(AlignedArray<T>& plane, AlignedArray<T>& error, std::size_t at,
              const Vector3d& exact) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double value = exact[static_cast<Eigen::Index>(axis)];
      const T rounded = plane.data()[at + axis] = static_cast<T>(value);
      if (law_.compensated) error.data()[at + axis] = static_cast<T>(double{rounded} - value);
    }
  }
  // Moves a free particle: adds to its position and its displacement of the step, m.
  void add(int particle, const Vector3d& by, const Vector3d& in_step) {
    const std::size_t at = place(particle);
    set_at(state_.x, state_.x_error, at, position_at(at) + by - origin_);
    set_at(state_.d, state_.d_error, at, exact(state_.d, state_.d_error, at) + in_step);
    for (std::size_t axis = 0; axis < 3; ++axis)
      state_.w.data()[at + axis] +=
          static_cast<T>(state_.lead * in_step[static_cast<Eigen::Index>(axis)]);
  }
  void put(AlignedArray<T>& plane, int particle, const Vector3d& values) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      plane.data()[place(particle) + axis] =
          static_cast<T>(values[static_cast<Eigen::Index>(axis)]);
  }

  // As resolve_run(), where particles may come through colliders unseen.
  Resolved resolve_in_parts(const Contacts& contacts, int run) {
    constexpr std::size_t kValues = 4 * kContactRun;
    Resolved resolved;
    const std::size_t begin = static_cast<std::size_t>(run) * kValues;
    for (std::size_t at = begin; at < begin + kValues; at += 4) {
      if (state_.step2.data()[at] == 0) continue;
      Vector3d x = position_at(at), d = exact(state_.d, state_.d_error, at);
      const Vector3d from = x, before = d;
      if (contacts.resolve(x, d)) {
        set_at(state_.x, state_.x_error, at, x - origin_);
        set_at(state_.d, state_.d_error, at, d);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const auto k = static_cast<Eigen::Index>(axis);
          state_.w.data()[at + axis] += static_cast<T>(state_.lead * (d[k] - before[k]));
        }
        resolved.move((position_at(at) - from).norm(),
                      (exact(state_.d, state_.d_error, at) - before).norm());
      }
      resolved.gap = std::min(resolved.gap, contacts.gap(x));
    }
    return resolved;
  }

  const Mesh& mesh_;
  const Dynamics& dynamics_;
  const IntegratorKind integrator_;
  int particles_;
  double dt_ = 0;
  TriangleLaw<T> law_;
  WindLaw<T> wind_;
  TriangleState<T> state_;
  bool started_ = false;
  Vector3d origin_ = Vector3d::Zero();  // that x is relative to, m
  StepMotion motion_;
  Gaps gaps_;                          // of runs
  std::vector<Hinge> hinges_;          // by numbers in hinged_
  std::vector<int> hinged_;            // particles
  Matrix3Xd hinged_x_, hinged_force_;  // of these, m and N
  std::vector<KnownCells> known_;      // of runs, where the first collider has a grid
};

template <class T>
std::unique_ptr<SheetSolver> make(const Mesh& mesh, const Dynamics& dynamics,
                                  const std::optional<Wind>& wind, bool compensated,
                                  IntegratorKind integrator) {
  auto law = make_triangle_law<T>(mesh, wind.has_value());
  if (!law) return make_plain_solver(dynamics, integrator);
  return std::make_unique<TriangleSolver<T>>(mesh, dynamics,
                                             wind ? make_wind_law<T>(*wind) : WindLaw<T>(),
                                             compensated, integrator, std::move(*law));
}

}  // namespace

std::unique_ptr<SheetSolver> make_triangle_solver(const Mesh& mesh, const Dynamics& dynamics,
                                                  const std::optional<Wind>& wind,
                                                  const SolverSettings& settings) {
  if (settings.precision == Precision::kDouble)
    return make<double>(mesh, dynamics, wind, false, settings.integrator);
  return make<float>(mesh, dynamics, wind, settings.compensated, settings.integrator);
}

}  // namespace weft

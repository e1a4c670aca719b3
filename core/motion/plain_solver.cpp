#include <algorithm>
#include <cmath>
#include <limits>

#include "core/motion/saved_values.h"
#include "core/motion/sheet_solver.h"

namespace weft {
namespace {

class PlainSolver : public SheetSolver {
 public:
  PlainSolver(const Dynamics& dynamics, IntegratorKind integrator)
      : dynamics_(dynamics), integrator_(make_integrator(integrator)) {}

  void start(const Matrix3Xd& x, const Matrix3Xd& v, double time, double dt) override {
    dt_ = dt;
    pushed_ = pulled_ = 0;
    motion_.x = x;
    integrator_->start(dynamics_, time, dt, v, motion_);
  }

  void advance(double time, int slow, ThreadPool& /*pool*/) override {
    integrator_->advance(dynamics_, time, dt_, slow, motion_);
  }

  void move_held(int particle, const Vector3d& x, const Vector3d& d) override {
    motion_.x.col(particle) = x;
    motion_.d.col(particle) = d;
  }

  void pull_back(ThreadPool& /*pool*/) override {
    pulled_ = weft::pull_back(
        dynamics_.tethers, kInward * dt_,
        [&](int i) {
          return Moved{motion_.x.col(i), motion_.d.col(i)};
        },
        [&](int i, const Moved& to) { motion_.x.col(i) = to.x, motion_.d.col(i) = to.d; });
  }

  void resolve(const Contacts& contacts, ThreadPool& /*pool*/) override {
    pushed_ = 0;
    for (Eigen::Index i = 0; i < motion_.x.cols(); ++i) {
      if (dynamics_.inverse_mass[i] == 0) continue;
      Vector3d x = motion_.x.col(i), d = motion_.d.col(i);
      if (!contacts.resolve(x, d)) continue;
      pushed_ = std::max(pushed_, (x - motion_.x.col(i)).norm());
      motion_.x.col(i) = x;
      motion_.d.col(i) = d;
    }
  }

  void measure() override {}
  double moved() const override {
    return std::sqrt(motion_.d.colwise().squaredNorm().maxCoeff()) + pulled_;
  }
  double pushed() const override { return pushed_; }
  double take_change() override { return std::numeric_limits<double>::infinity(); }
  void read(std::span<const int> particles, Eigen::Ref<Matrix3Xd> x,
            Eigen::Ref<Matrix3Xd> d) const override {
    for (Eigen::Index k = 0; const int i : particles) {
      x.col(k) = motion_.x.col(i);
      d.col(k++) = motion_.d.col(i);
    }
  }
  void displace(std::span<const int> particles, const Eigen::Ref<const Matrix3Xd>& by,
                const Eigen::Ref<const Matrix3Xd>& in_step) override {
    for (Eigen::Index k = 0; const int i : particles) {
      motion_.x.col(i) += by.col(k);
      motion_.d.col(i) += in_step.col(k++);
    }
  }

  void positions(Matrix3Xd& x) const override { x = motion_.x; }
  void velocities(Matrix3Xd& v) const override { integrator_->velocity(motion_, dt_, v); }
  void closing_velocities(double time, Matrix3Xd& v) const override {
    integrator_->closing_velocity(dynamics_, time, dt_, motion_, v);
  }

  std::string save() const override {
    SavedValues saved;
    for (const Matrix3Xd* plane : {&motion_.x, &motion_.d, &motion_.d_previous})
      saved.put(plane->data(), static_cast<std::size_t>(plane->size()));
    return saved.bytes();
  }
  bool load(const std::string& saved) override {
    LoadedValues loaded(saved);
    for (Matrix3Xd* plane : {&motion_.x, &motion_.d, &motion_.d_previous})
      loaded.take(plane->data(), static_cast<std::size_t>(plane->size()));
    return loaded.all_taken();
  }

 private:
  const Dynamics& dynamics_;
  std::unique_ptr<Integrator> integrator_;
  Motion motion_;
  double dt_ = 0;
  double pushed_ = 0, pulled_ = 0;  // by colliders and tethers, m
};

}  // namespace

std::unique_ptr<SheetSolver> make_plain_solver(const Dynamics& dynamics,
                                               IntegratorKind integrator) {
  return std::make_unique<PlainSolver>(dynamics, integrator);
}

}  // namespace weft

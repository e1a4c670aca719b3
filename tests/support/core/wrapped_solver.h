#pragma once

#include <memory>
#include <string>
#include <utility>

#include "core/motion/sheet_solver.h"

namespace weft::testing {

// Does as another one does, on one thread: what tests watch or disturb a solver by.
class WrappedSolver : public SheetSolver {
 public:
  explicit WrappedSolver(std::unique_ptr<SheetSolver> solver) : solver_(std::move(solver)) {}

  void start(const Matrix3Xd& x, const Matrix3Xd& v, double time, double dt) override {
    solver_->start(x, v, time, dt);
  }
  void advance(double time, int slow, ThreadPool& pool) override {
    solver_->advance(time, slow, pool);
  }
  void move_held(int particle, const Vector3d& x, const Vector3d& d) override {
    solver_->move_held(particle, x, d);
  }
  void pull_back(ThreadPool& pool) override { solver_->pull_back(pool); }
  void resolve(const Contacts& contacts, ThreadPool& pool) override {
    solver_->resolve(contacts, pool);
  }
  void measure() override { solver_->measure(); }
  double moved() const override { return solver_->moved(); }
  double pushed() const override { return solver_->pushed(); }
  double take_change() override { return solver_->take_change(); }
  void read(std::span<const int> particles, Eigen::Ref<Matrix3Xd> x,
            Eigen::Ref<Matrix3Xd> d) const override {
    solver_->read(particles, x, d);
  }
  void displace(std::span<const int> particles, const Eigen::Ref<const Matrix3Xd>& by,
                const Eigen::Ref<const Matrix3Xd>& in_step) override {
    solver_->displace(particles, by, in_step);
  }
  void positions(Matrix3Xd& x) const override { solver_->positions(x); }
  void velocities(Matrix3Xd& v) const override { solver_->velocities(v); }
  void closing_velocities(double time, Matrix3Xd& v) const override {
    solver_->closing_velocities(time, v);
  }
  std::string save() const override { return solver_->save(); }
  bool load(const std::string& saved) override { return solver_->load(saved); }

 private:
  std::unique_ptr<SheetSolver> solver_;
};

}  // namespace weft::testing

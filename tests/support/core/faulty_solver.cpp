#include "tests/support/core/faulty_solver.h"

#include <memory>
#include <utility>

#include "core/motion/sheet_solver.h"

namespace weft::testing {
namespace {

class FaultySolver : public SheetSolver {
 public:
  FaultySolver(std::unique_ptr<SheetSolver> solver, double from, double jump,
               std::shared_ptr<int> times)
      : solver_(std::move(solver)), from_(from), jump_(jump), times_(std::move(times)) {}

  void start(const Matrix3Xd& x, const Matrix3Xd& v, double time, double dt) override {
    struck_ = false;
    solver_->start(x, v, time, dt);
  }
  void advance(double time, int slow, ThreadPool& pool) override {
    solver_->advance(time, slow, pool);
    if (time < from_ || *times_ == 0 || std::exchange(struck_, true)) return;
    --*times_;
    Matrix3Xd x;
    solver_->positions(x);
    const auto middle = static_cast<int>(x.cols() / 2);
    const Vector3d jump(0, jump_, 0);
    solver_->move_held(middle, x.col(middle) + jump, jump);
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
  double from_;                 // s
  double jump_;                 // m
  std::shared_ptr<int> times_;  // still to strike
  bool struck_ = false;         // since it started
};

}  // namespace

SolverFactory faulty_solvers(const Fault& fault) {
  return [fault, times = std::make_shared<int>(fault.times)](
             const Scene& scene, const SheetDefinition& sheet, const Mesh& mesh,
             const Dynamics& dynamics) {
    // half a frame before the end of it
    const double from = (static_cast<double>(fault.frame) - 0.5) * scene.solver.frame_step;
    return std::make_unique<FaultySolver>(make_solver(scene, sheet, mesh, dynamics), from,
                                          fault.jump, times);
  };
}

}  // namespace weft::testing

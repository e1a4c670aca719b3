#include "tests/support/core/faulty_solver.h"

#include <memory>
#include <utility>

#include "tests/support/core/wrapped_solver.h"

namespace weft::testing {
namespace {

class FaultySolver : public WrappedSolver {
 public:
  FaultySolver(std::unique_ptr<SheetSolver> solver, double from, double jump,
               std::shared_ptr<int> times)
      : WrappedSolver(std::move(solver)), from_(from), jump_(jump), times_(std::move(times)) {}

  void start(const Matrix3Xd& x, const Matrix3Xd& v, double time, double dt) override {
    struck_ = false;
    WrappedSolver::start(x, v, time, dt);
  }
  void advance(double time, int slow, ThreadPool& pool) override {
    WrappedSolver::advance(time, slow, pool);
    if (time < from_ || *times_ == 0 || std::exchange(struck_, true)) return;
    --*times_;
    Matrix3Xd x;
    positions(x);
    const auto middle = static_cast<int>(x.cols() / 2);
    const Vector3d jump(0, jump_, 0);
    move_held(middle, x.col(middle) + jump, jump);
  }

 private:
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

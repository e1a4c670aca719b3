#include "core/motion/step_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iterator>
#include <memory>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "core/sheet_factory.h"
#include "core/simulation.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/touching_sheets.h"
#include "tests/support/core/wrapped_solver.h"

namespace weft::testing {
namespace {

// Holds what a solver says of its motion against its particles, in every step.
class Watched : public WrappedSolver {
 public:
  struct Seen {
    int steps = 0;
    double change = 0, told = 0;  // the largest, and what was told of that step, m
  };
  Watched(std::unique_ptr<SheetSolver> solver, int particles, Seen& seen)
      : WrappedSolver(std::move(solver)),
        particles_(static_cast<std::size_t>(particles)),
        seen_(seen) {
    std::iota(particles_.begin(), particles_.end(), 0);
  }

  void start(const Matrix3Xd& x, const Matrix3Xd& v, double time, double dt) override {
    WrappedSolver::start(x, v, time, dt);
    x_ = {};
  }
  void advance(double time, int slow, ThreadPool& pool) override {
    WrappedSolver::advance(time, slow, pool);
    has_stepped_ = true;
  }
  double take_change() override {
    constexpr double kRounding = 1e-12;  // m, of double precision
    const double told = WrappedSolver::take_change();
    Matrix3Xd x(3, std::ssize(particles_)), d = x;
    read(particles_, x, d);
    if (x_.cols() > 0) {
      const double most = kRounding + told;
      EXPECT_LE(farthest(d - d_), most);
      EXPECT_LE(farthest(x - x_ - (has_stepped_ ? 1.0 : 0.0) * d_), most);
      ++seen_.steps;
      if (const double change = farthest(d - d_); change > seen_.change)
        std::tie(seen_.change, seen_.told) = std::pair(change, told);
    }
    std::tie(x_, d_) = std::pair(x, d);
    has_stepped_ = false;
    return told;
  }

 private:
  static double farthest(const Matrix3Xd& ways) {
    return std::sqrt(ways.colwise().squaredNorm().maxCoeff());
  }
  std::vector<int> particles_;
  Matrix3Xd x_, d_;           // when last asked, m
  bool has_stepped_ = false;  // since then
  Seen& seen_;
};

// On a block that a pin draws it over, in the wind, kept within the reach of that pin.
Scene drawn_over_a_block(const SheetDefinition& sheet) {
  Scene scene = touching({sheet});
  SheetDefinition& cloth = scene.sheets[0];
  cloth.origin = {-0.03, 0.002, -0.03};
  cloth.pins = {{{0}, {{0, {0, 0, 0}}, {0.01, {0, 0, 0}}, {0.05, {-0.05, 0.01, -0.05}}}}};
  cloth.tether_stretch = 0.02;
  scene.colliders = {{"block", Box{{0, -0.02, 0}, {0.024, 0.02, 0.024}}, 0.3, {}}};
  scene.environment.gravity = {0, -9.8, 0};
  scene.environment.wind = Wind{.velocity = {1, 0, 3}};
  scene.solver.precision = Precision::kDouble;
  scene.solver.frame_step = 0.01;
  return scene;
}

TEST(StepMotion, IsToldToChangeByNoLessThanThatOfAnyParticleDoes) {
  for (const SheetDefinition& sheet : {soft_lattice(9, 9), soft_rectangle(0.08, 0.08)}) {
    SCOPED_TRACE(sheet.name);
    Watched::Seen seen;
    Simulation simulation(
        drawn_over_a_block(sheet), [&](const Scene& scene, const SheetDefinition& definition,
                                       const Mesh& mesh, const Dynamics& dynamics) {
          return std::make_unique<Watched>(make_solver(scene, definition, mesh, dynamics),
                                           definition.particle_count(), seen);
        });
    for (int frame = 0; frame < 6; ++frame) ASSERT_TRUE(simulation.advance_frame());
    EXPECT_GT(seen.steps, 300);
    EXPECT_LT(seen.told, 6 * seen.change);
  }
}

}  // namespace
}  // namespace weft::testing

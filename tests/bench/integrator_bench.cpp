#include <benchmark/benchmark.h>

#include <string>

#include "core/motion/integrator.h"
#include "tests/support/core/scenes.h"

namespace weft {
namespace {

// Steps 31 x 31 particles on which a constant force acts, for what an integrator costs beside it.
void advance(benchmark::State& state, IntegratorKind kind) {
  constexpr Eigen::Index kParticles = 31 * 31;
  Dynamics dynamics;
  dynamics.force = [](double, const Matrix3Xd&, const Matrix3Xd&, Matrix3Xd& force) {
    force.setOnes(3, kParticles);
  };
  dynamics.inverse_mass = VectorXd::Ones(kParticles);
  dynamics.gravity.setZero();
  const auto integrator = make_integrator(kind);
  Motion motion;
  motion.x = testing::noise(kParticles);
  const double dt = 1e-9;
  integrator->start(dynamics, 0, dt, Matrix3Xd::Zero(3, kParticles), motion);
  for (auto _ : state) {
    integrator->advance(dynamics, 0, dt, 1, motion);
    benchmark::DoNotOptimize(motion.x.data());
  }
  state.SetItemsProcessed(state.iterations() * kParticles);
}

BENCHMARK_CAPTURE(advance, VERLET, IntegratorKind::kVerlet)->Name("integrator/VERLET");
BENCHMARK_CAPTURE(advance, EULER, IntegratorKind::kEuler)->Name("integrator/EULER");
BENCHMARK_CAPTURE(advance, MIDPOINT, IntegratorKind::kMidpoint)->Name("integrator/MIDPOINT");
BENCHMARK_CAPTURE(advance, RK4, IntegratorKind::kRk4)->Name("integrator/RK4");

}  // namespace
}  // namespace weft

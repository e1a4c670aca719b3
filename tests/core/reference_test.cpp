#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/core/reference_case.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

// Root mean square over all coordinates against the reference's last row, m.
double error_at_end(ReferenceCase reference, double substep,
                    IntegratorKind integrator = IntegratorKind::kVerlet) {
  reference.scene.solver.substep = substep;
  reference.scene.solver.integrator = integrator;
  reference.scene.solver.allow_unstable = integrator != IntegratorKind::kVerlet;
  EXPECT_TRUE(find_problems(reference.scene).empty());
  Simulation simulation(reference.scene);
  const auto frames = std::lround(reference.times.back() / reference.scene.solver.frame_step);
  for (int frame = 0; frame < frames; ++frame) EXPECT_TRUE(simulation.advance_frame());
  const Matrix3Xd x = positions(simulation);
  const Eigen::Map<const Matrix3Xd> truth(reference.positions.back().data(), 3, x.cols());
  return (x - truth).norm() / std::sqrt(static_cast<double>(x.cols()));
}

TEST(Reference, AHungSheetFollowsTheIndependentSolution) {
  EXPECT_LT(error_at_end(load_reference_case("hang_6x6"), 2.5e-5), 1e-7);
}

TEST(Reference, ABucklingSheetFollowsTheIndependentSolution) {
  EXPECT_LT(error_at_end(load_reference_case("buckle_5x9"), 2.5e-5), 5e-5);
}

TEST(Reference, AFlagFollowsTheIndependentSolution) {
  EXPECT_LT(error_at_end(load_reference_case("flag_4x7"), 2.5e-5), 1e-7);
}

TEST(Reference, VerletIsOfSecondOrderWithDampingAndDrag) {
  const ReferenceCase flag = load_reference_case("flag_4x7");
  const double coarse = error_at_end(flag, 5e-5), fine = error_at_end(flag, 2.5e-5);
  EXPECT_GT(coarse / fine, 3.5);
}

TEST(Reference, MidpointAndRungeKuttaMeetTheSameSolutionAndEulerComesNear) {
  const ReferenceCase flag = load_reference_case("flag_4x7");
  EXPECT_LT(error_at_end(flag, 2.5e-5, IntegratorKind::kMidpoint), 1e-6);
  EXPECT_LT(error_at_end(flag, 2.5e-5, IntegratorKind::kRk4), 1e-7);
  const double coarse = error_at_end(flag, 1e-5, IntegratorKind::kEuler);
  const double fine = error_at_end(flag, 5e-6, IntegratorKind::kEuler);
  EXPECT_LT(fine, 1e-3);
  EXPECT_NEAR(coarse / fine, 2, 0.3);  // first order
}

}  // namespace
}  // namespace weft::testing

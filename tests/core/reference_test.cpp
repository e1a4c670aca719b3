#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "core/sheet_factory.h"
#include "tests/support/core/reference_case.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

// Root mean square over all coordinates against the reference's last row, m.
double error_at_end(ReferenceCase reference, std::optional<double> substep,
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

// The case as the vector kernels compute it: with a polynomial that is as good as the exact curve.
ReferenceCase for_kernels(const char* name, Precision precision) {
  ReferenceCase reference = load_reference_case(name);
  SheetDefinition& sheet = reference.scene.sheets[0];
  auto& law = std::get<ChoiKo>(sheet.bending);
  law.evaluator = Evaluator::kPolynomial;
  law.degree = 20;
  reference.scene.solver.precision = precision;
  EXPECT_EQ(needs_plain_solver(reference.scene, sheet), "");
  return reference;
}

TEST(Reference, TheVectorKernelsFollowTheIndependentSolutions) {
  EXPECT_LT(error_at_end(for_kernels("hang_6x6", Precision::kDouble), 2.5e-5), 1e-7);
  EXPECT_LT(error_at_end(for_kernels("buckle_5x9", Precision::kDouble), 2.5e-5), 5e-5);
  EXPECT_LT(error_at_end(for_kernels("flag_4x7", Precision::kDouble), 2.5e-5), 1e-7);
}

TEST(Reference, SinglePrecisionAddsAtMostHalfToTheErrorOfThePlannedStep) {
  for (const char* name : {"hang_6x6", "buckle_5x9", "flag_4x7"}) {
    const double in_double = error_at_end(for_kernels(name, Precision::kDouble), {});
    const double in_single = error_at_end(for_kernels(name, Precision::kSingle), {});
    EXPECT_LE(in_single, 1.5 * in_double) << name;
  }
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

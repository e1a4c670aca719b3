#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/sheet_factory.h"
#include "core/triangles/cut.h"
#include "core/triangles/triangles.h"
#include "tests/support/core/energy_trial.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

constexpr MeasuredTextile kCloth{.areal_density = 0.2,
                                 .tensile_warp = 900,
                                 .tensile_weft = 600,
                                 .shear = 100,
                                 .bend_rigidity_warp = 1e-5,
                                 .bend_rigidity_weft = 1e-5,
                                 .air_drag = 0};

SheetDefinition triangle_sheet(double ratio) {
  SheetDefinition sheet = flat_sheet(2, 2);
  sheet.shape = complete(triangle_mesh(cut_rectangle(Cut::kIrregular, 0.5, 0.5, 0.05)));
  sheet.textile = {kCloth, {}, 0};
  sheet.textile.damping_ratio = ratio;
  sheet.bending = Isometric{};
  return sheet;
}

Plan plan_of(const SheetDefinition& sheet, StepBound bound) {
  Scene scene = floating(sheet);
  scene.solver.step_bound = bound;
  return Simulation(scene).plan();
}

// Whether a disturbance of 1e-7 m of a flat sheet at rest stays below 1e-5 m for 20 000 steps.
bool survives(const SheetDefinition& sheet, double dt) {
  SheetDefinition disturbed = sheet;
  const Matrix3Xd rest = start_positions(sheet);
  disturbed.start_positions = values(rest + 1e-7 * noise(sheet.particle_count()));
  Scene scene = floating(disturbed);
  scene.solver.precision = Precision::kDouble;
  scene.solver.frame_step = 1000 * dt;
  scene.solver.substep = dt;
  scene.solver.allow_unstable = true;
  scene.solver.max_repairs = 0;
  Simulation simulation(scene);
  for (int frame = 0; frame < 20; ++frame)
    if (!simulation.advance_frame() ||
        !((positions(simulation) - rest).cwiseAbs().maxCoeff() < 1e-5))
      return false;
  return true;
}

// omega^2 = 12 k / m where all connections of a particle pull the same way, 8 k / m where they
// cross as in the lattice.
TEST(UnshearedStep, OfALatticeIsThatOfThreadsThatCrossAtRightAngles) {
  SheetDefinition sheet = flat_sheet(40, 40, 0.05);
  sheet.textile = {RawTextile{.particle_mass = 1e-3, .stretch = 1000, .shear = 1000}, 0, 0};
  const Mesh mesh = make_mesh(sheet);
  EXPECT_NEAR(unsheared_gain_of(sheet, mesh, mesh.mass.cwiseInverse(), IntegratorKind::kVerlet, 0),
              std::sqrt(12.0 / 8), 0.003);
}

TEST(UnshearedStep, OfTrianglesIsStableWhereTheyKeepTheirShapeAndAQuarterMoreIsNot) {
  const SheetDefinition sheet = triangle_sheet(0.02);
  const StepPlan step = plan_of(sheet, StepBound::kUnsheared).step;
  EXPECT_GT(step.unsheared_bound, 1.2 * step.linear_bound);
  EXPECT_TRUE(survives(sheet, 0.99 * step.unsheared_bound));
  EXPECT_FALSE(survives(sheet, 1.25 * step.unsheared_bound));
}

TEST(UnshearedStep, IsPlannedWhereItIsAskedForAndDampingBearsIt) {
  const auto substeps = [](double ratio, StepBound bound) {
    return static_cast<double>(plan_of(triangle_sheet(ratio), bound).step.substeps);
  };
  EXPECT_GT(substeps(0.02, StepBound::kEveryShape), 1.2 * substeps(0.02, StepBound::kUnsheared));
  EXPECT_EQ(substeps(0.002, StepBound::kEveryShape), substeps(0.002, StepBound::kUnsheared));
  const StepPlan every = plan_of(triangle_sheet(0.02), StepBound::kEveryShape).step;
  EXPECT_EQ(every.unsheared_bound, 0);
}

TEST(UnshearedStep, IsRefusedAboveItsOwnBound) {
  const SheetDefinition sheet = triangle_sheet(0.02);
  const double bound = plan_of(sheet, StepBound::kUnsheared).step.unsheared_bound;
  Scene scene = floating(sheet);
  scene.solver.step_bound = StepBound::kUnsheared;
  scene.solver.frame_step = scene.solver.substep.emplace(0.99 * bound);
  EXPECT_FALSE(Simulation(scene).refusal());
  scene.solver.frame_step = scene.solver.substep.emplace(1.01 * bound);
  const auto refusal = Simulation(scene).refusal();
  ASSERT_TRUE(refusal);
  EXPECT_DOUBLE_EQ(refusal->bound, bound);
  scene.solver.step_bound = StepBound::kEveryShape;
  scene.solver.frame_step = scene.solver.substep.emplace(0.99 * bound);
  EXPECT_TRUE(Simulation(scene).refusal());
}

// Drawn out along a diagonal until threads cross at some 40 degrees, and held there.
TEST(UnshearedStep, OfASheetThatIsShearedFarEndsWhereAShorterOneDoes) {
  SheetDefinition sheet = flat_sheet(12, 12, 0.05);
  MeasuredTextile soft = kCloth;
  soft.shear = 10;
  sheet.textile = {soft, {}, 0};
  sheet.textile.damping_ratio = 0.02;
  sheet.pins = {{{0}, {}}, {{143}, {{0, Vector3d::Zero()}, {1, {0.19, 0, 0.19}}}}};
  const auto end_of = [&](StepBound bound) {
    Scene scene = floating(sheet);
    scene.environment.gravity = {0, -9.8, 0};
    scene.solver.step_bound = bound;
    Simulation simulation(scene);
    while (simulation.time() < 1.5) EXPECT_TRUE(simulation.advance_frame());
    return positions(simulation);
  };
  const Matrix3Xd apart = end_of(StepBound::kEveryShape) - end_of(StepBound::kUnsheared);
  EXPECT_LT(std::sqrt(apart.squaredNorm() / 144), 2e-3);
}

// `./dev bench stability` tries 2000 of them.
TEST(UnshearedStep, GivesUndisturbedSheetsNoEnergyUnlessSomebodyIsTold) {
  for (const auto integrator : {IntegratorKind::kVerlet, IntegratorKind::kLaggedVerlet}) {
    std::mt19937_64 random(1);
    for (int k = 0, longer = 0; longer < 30; ++k) {
      Scene scene = undisturbed_scene(random);
      scene.solver.step_bound = StepBound::kUnsheared;
      scene.solver.integrator = integrator;
      const StepPlan step = Simulation(scene).plan().step;
      if (step.unsheared_bound == step.linear_bound) continue;
      ++longer;
      const EnergyTrial trial = try_energy(scene, 10);
      EXPECT_FALSE(trial.silent_gain())
          << "scene " << k << " gained " << trial.gain << " J of " << trial.stored;
    }
  }
}

}  // namespace
}  // namespace weft::testing

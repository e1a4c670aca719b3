#include "core/motion/stability.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/lattice/sample.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

struct Lattice {
  const char* name;
  int rows, columns;
  double damping;
  bool isometric = false;
  IntegratorKind integrator = IntegratorKind::kVerlet;
};

SheetDefinition pre_stretched(const Lattice& lattice) {
  SheetDefinition sheet = flat_sheet(lattice.rows, lattice.columns, 0.05);
  sheet.textile.damping = lattice.damping;
  if (lattice.isometric) sheet.bending = Isometric{};
  sheet.start_positions = values(stretched(sheet, 0.02));
  Pin rim;
  for (int r = 0; r < lattice.rows; ++r)
    for (int c = 0; c < lattice.columns; ++c)
      if (r == 0 || c == 0 || r == lattice.rows - 1 || c == lattice.columns - 1)
        rim.particles.push_back(r * lattice.columns + c);
  sheet.pins = {rim};
  return sheet;
}

// Whether a disturbance of 1e-6 h stays below `limit` x h for 20 000 steps.
bool survives(SheetDefinition sheet, double limit, double dt, IntegratorKind integrator) {
  const double h = sheet.spacing();
  const Matrix3Xd rest = stretched(sheet, 0.02);
  Matrix3Xd disturbed = rest + 1e-6 * h * noise(sheet.particle_count());
  for (const int i : sheet.pins[0].particles) disturbed.col(i) = rest.col(i);
  sheet.start_positions = values(disturbed);
  Scene scene = floating(sheet);
  scene.solver.frame_step = 1000 * dt;
  scene.solver.substep = dt;
  scene.solver.integrator = integrator;
  scene.solver.allow_unstable = true;
  scene.solver.max_repairs = 0;
  Simulation simulation(scene);
  for (int frame = 0; frame < 20; ++frame)
    if (!simulation.advance_frame() ||
        (positions(simulation) - rest).cwiseAbs().maxCoeff() > limit * h)
      return false;
  return true;
}

class Step : public ::testing::TestWithParam<Lattice> {};

TEST_P(Step, OfAPreStretchedLatticeIsNeverBelowTheBoundAndWithinTwoPercentOfTheEstimate) {
  const SheetDefinition sheet = pre_stretched(GetParam());
  const IntegratorKind integrator = GetParam().integrator;
  Scene planned = floating(sheet);
  planned.solver.integrator = integrator;
  const StepPlan plan = Simulation(planned).plan().step;
  // with strong damping, springs that go slack keep an unstable motion small: stay in the linear
  // range
  const double limit = GetParam().damping > 1e-3 ? 1e-3 : 1;
  double stable = 0.5 * plan.linear_bound, unstable = 2 * plan.estimated_bound;
  ASSERT_TRUE(survives(sheet, limit, stable, integrator));
  ASSERT_FALSE(survives(sheet, limit, unstable, integrator));
  while (unstable / stable > 1.002) {
    const double middle = std::sqrt(stable * unstable);
    (survives(sheet, limit, middle, integrator) ? stable : unstable) = middle;
  }
  RecordProperty("measured_over_bound", std::to_string(stable / plan.linear_bound));
  RecordProperty("measured_over_estimate", std::to_string(stable / plan.estimated_bound));
  EXPECT_GE(unstable, plan.linear_bound);
  EXPECT_NEAR(stable / plan.estimated_bound, 1, 0.02);
}

INSTANTIATE_TEST_SUITE_P(Lattices, Step,
                         ::testing::Values(Lattice{"Undamped", 8, 8, 0},
                                           Lattice{"PaperDamping", 9, 7, 2e-4},
                                           Lattice{"Damped", 8, 8, 0.05},
                                           Lattice{"HeavilyDamped", 8, 8, 0.5},
                                           Lattice{"DampedHalfAStepLate", 8, 8, 0.05, false,
                                                   IntegratorKind::kLaggedVerlet},
                                           Lattice{"HeavilyDampedHalfAStepLate", 8, 8, 0.5, false,
                                                   IntegratorKind::kLaggedVerlet},
                                           Lattice{"Isometric", 8, 8, 0, true}),
                         [](const auto& tested) { return tested.param.name; });

// omega^2 = 8 k / m of the taut lattice without bending: dt = 0.707 sqrt(m / k).
TEST(StableStep, OfATautLatticeNearsTheTextbookValue) {
  SheetDefinition sheet = flat_sheet(40, 40, 0.05);
  sheet.textile = {RawTextile{.particle_mass = 1e-3, .stretch = 1000, .shear = 1000}, 0, 0};
  sheet.start_positions = values(stretched(sheet, 1e-9));
  const StepPlan step = Simulation(floating(sheet)).plan().step;
  const double unit = std::sqrt(1e-3 / 1000);
  EXPECT_NEAR(step.estimated_bound / unit, 0.7071, 0.003);
  EXPECT_NEAR(step.linear_bound / unit, 2 / std::sqrt(12.0), 0.003);
}

TEST(StableStep, IsUnlimitedWhereNothingPulls) {
  SheetDefinition sheet = flat_sheet(4, 4);
  sheet.textile = {RawTextile{.particle_mass = 1e-3}, 0, 0};
  const Plan plan = Simulation(floating(sheet)).plan();
  EXPECT_EQ(plan.step.linear_bound, std::numeric_limits<double>::infinity());
  EXPECT_EQ(plan.step.substeps, 1);
}

TEST(StableStep, DoesNotExistForUndampedEulerAndMidpoint) {
  for (const auto integrator : {IntegratorKind::kEuler, IntegratorKind::kMidpoint}) {
    SheetDefinition sheet = flat_sheet(4, 4);
    sheet.textile.damping = 0;
    Scene scene = floating(sheet);
    scene.solver.integrator = integrator;
    Simulation simulation(scene);
    EXPECT_EQ(simulation.plan().step.linear_bound, 0);
    EXPECT_TRUE(simulation.refusal());
  }
}

// A mode of one spring between a held and a free particle: z = dt (-gamma / 2 +- i omega) must lie
// where the method does not grow.
TEST(StableStep, KeepsDampedEulerMidpointAndRungeKuttaFromGrowing) {
  for (const auto integrator :
       {IntegratorKind::kEuler, IntegratorKind::kMidpoint, IntegratorKind::kRk4}) {
    SheetDefinition sheet = pre_stretched({"", 5, 5, 0.02});
    Scene scene = floating(sheet);
    scene.solver.integrator = integrator;
    const double bound = Simulation(scene).plan().step.linear_bound;
    ASSERT_GT(bound, 0);
    const Matrix3Xd rest = stretched(sheet, 0.02);
    Matrix3Xd disturbed = rest + 1e-4 * noise(25);
    for (const int i : sheet.pins[0].particles) disturbed.col(i) = rest.col(i);
    scene.sheets[0].start_positions = values(disturbed);
    scene.solver.substep = bound;
    scene.solver.frame_step = 2000 * bound;
    Simulation simulation(scene);
    ASSERT_FALSE(simulation.refusal());
    for (int frame = 0; frame < 5; ++frame) ASSERT_TRUE(simulation.advance_frame());
    EXPECT_LT((positions(simulation) - rest).cwiseAbs().maxCoeff(), 1e-4)
        << static_cast<int>(integrator);
  }
}

TEST(StableStep, StrongDragShortensTheStepOfThoseThatTakeItExplicitly) {
  for (const auto integrator :
       {IntegratorKind::kVerlet, IntegratorKind::kEuler, IntegratorKind::kMidpoint,
        IntegratorKind::kRk4, IntegratorKind::kLaggedVerlet}) {
    SheetDefinition sheet = flat_sheet(4, 4);
    std::get<RawTextile>(sheet.textile.model).air_drag = 50;
    sheet.start_velocities = values(noise(16));
    Scene scene = floating(sheet);
    scene.solver.integrator = integrator;
    scene.solver.frame_step = 1e-3;
    Simulation simulation(scene);
    ASSERT_FALSE(simulation.refusal());
    for (int frame = 0; frame < 20; ++frame) ASSERT_TRUE(simulation.advance_frame());
    EXPECT_LT(velocities(simulation).cwiseAbs().maxCoeff(), 1) << static_cast<int>(integrator);
  }
}

TEST(StableStep, AnAskedStepAboveTheBoundIsRefusedUnlessAllowed) {
  Scene scene = floating(flat_sheet(5, 5));
  const double bound = Simulation(scene).plan().step.linear_bound;
  scene.solver.frame_step = scene.solver.substep.emplace(1.01 * bound);
  const auto refusal = Simulation(scene).refusal();
  ASSERT_TRUE(refusal);
  EXPECT_DOUBLE_EQ(refusal->asked, 1.01 * bound);
  EXPECT_DOUBLE_EQ(refusal->bound, bound);
  scene.solver.allow_unstable = true;
  const Simulation allowed(scene);
  EXPECT_FALSE(allowed.refusal());
  EXPECT_EQ(allowed.plan().warnings.back().code, "STEP_UNSTABLE");
}

TEST(StableStep, ThePlannedStepIsTheBoundTimesSafetyDividedIntoTheFrame) {
  Scene scene = floating(flat_sheet(5, 5));
  scene.solver.safety = 0.5;
  const StepPlan step = Simulation(scene).plan().step;
  EXPECT_LE(step.substep, 0.5 * step.linear_bound);
  EXPECT_GT(step.substep, 0.45 * step.linear_bound);
  EXPECT_DOUBLE_EQ(step.substep * static_cast<double>(step.substeps), scene.solver.frame_step);
}

TEST(StableStep, AnAskedStepThatDividesTheFrameIsTakenAsItIs) {
  Scene scene = floating(flat_sheet(3, 3));
  scene.solver.frame_step = 0.01;
  scene.solver.substep = 2.5e-5;
  EXPECT_EQ(Simulation(scene).plan().step.substeps, 400);
  scene.solver.substep = 2.6e-5;
  EXPECT_EQ(Simulation(scene).plan().step.substeps, 385);
}

// A window with a corner has the modes that limit the step: of the middle, of edges, where a
// measured textile has half a mass, and of corners.
TEST(StableStep, OfALatticeIsThatOfASampleOfIt) {
  for (const bool measured : {false, true})
    for (const bool isometric : {false, true}) {
      SheetDefinition sheet = flat_sheet(130, 171, 0.01);
      if (measured)
        sheet.textile.model = MeasuredTextile{.areal_density = 0.2,
                                              .tensile_warp = 900,
                                              .tensile_weft = 300,
                                              .shear = 30,
                                              .bend_rigidity_warp = 1e-5,
                                              .bend_rigidity_weft = 2e-5};
      if (isometric) sheet.bending = Isometric{};
      const Mesh mesh = make_mesh(sheet);
      const LatticeSample sample = sample_of(grid_of(sheet), mesh);
      EXPECT_LT(sample.mesh.mass.size(), mesh.mass.size() / 2);
      const Matrix3Xd x = stretched(sheet, 0.02);
      const auto step_of = [](const Mesh& of, const Matrix3Xd& at) {
        return stable_step(of, of.mass.cwiseInverse(), IntegratorKind::kVerlet, 0, at);
      };
      const StableStep whole = step_of(mesh, x);
      const StableStep part = step_of(sample.mesh, x(Eigen::all, sample.particles));
      EXPECT_NEAR(part.linear_bound / whole.linear_bound, 1, 3e-4) << measured << isometric;
      EXPECT_NEAR(part.estimate / whole.estimate, 1, 3e-4) << measured << isometric;
      EXPECT_NEAR(part.connection_ratio / whole.connection_ratio, 1, 1e-3);
      EXPECT_NEAR(damping_for(sample.mesh, 0.01) / damping_for(mesh, 0.01), 1, 1e-3);
    }
}

TEST(StableStep, OfALargeLatticeIsEstimatedWhereItIsTautest) {
  const SheetDefinition sheet = flat_sheet(130, 171, 0.01);
  const Mesh mesh = make_mesh(sheet);
  Matrix3Xd x = start_positions(sheet);
  const int taut = 90 * 171 + 120;
  x.col(taut).y() += 0.05;
  EXPECT_NEAR(tautest_particle(mesh, x), taut, 2 * 171 + 2);
  const LatticeSample sample = sample_of(grid_of(sheet), mesh, tautest_particle(mesh, x));
  EXPECT_NE(std::find(sample.particles.begin(), sample.particles.end(), taut),
            sample.particles.end());
}

}  // namespace
}  // namespace weft::testing

#include "core/motion/guard.h"

#include <gmock/gmock.h>

#include <limits>

#include "core/motion/sheet_solver.h"
#include "tests/support/core/faulty_solver.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Scene hung() {
  SheetDefinition sheet = flat_sheet(6, 7);
  sheet.pins = {{{0, 6}, {}}};
  Scene scene = floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  return scene;
}

void expect_finite(const Simulation& simulation) {
  EXPECT_TRUE(positions(simulation).allFinite());
  EXPECT_TRUE(velocities(simulation).allFinite());
}

TEST(Guard, AFaultThatPassesCostsOneRepairAndTheFramesGoOnAsWithoutIt) {
  for (const double fault : {kNan, std::numeric_limits<double>::infinity(), 1e30, 1e3}) {
    SCOPED_TRACE(fault);
    const Scene scene = hung();
    Simulation sound(scene), hit(scene, faulty_solvers({.frame = 5, .times = 1, .jump = fault}));
    for (int frame = 0; frame < 20; ++frame) {
      ASSERT_TRUE(sound.advance_frame());
      ASSERT_TRUE(hit.advance_frame());
      expect_finite(hit);
    }
    ASSERT_THAT(hit.repairs(), SizeIs(1));
    EXPECT_EQ(hit.repairs()[0].frame, 5);
    EXPECT_EQ(hit.repairs()[0].substep, sound.plan().step.substep / 2);
    EXPECT_EQ(hit.plan().step.substeps, 2 * sound.plan().step.substeps)
        << "the step stays halved for a while";
    // apart by the error of the longer step, far below the 0.2 m the sheet has fallen
    EXPECT_LT((positions(hit) - positions(sound)).cwiseAbs().maxCoeff(), 1e-3);
    EXPECT_THAT(sound.repairs(), IsEmpty());
  }
}

TEST(Guard, TheStepGrowsAgainAfterGoodFramesTwiceAsManyEachTimeFramesBreak) {
  const Scene scene = hung();
  const std::int64_t planned = Simulation(scene).plan().step.substeps;
  Simulation simulation(scene, faulty_solvers({.frame = 5, .times = 2, .jump = kNan}));
  const auto substeps_at = [&](std::int64_t frame) {
    while (simulation.frame() < frame) EXPECT_TRUE(simulation.advance_frame());
    return simulation.substeps();
  };
  EXPECT_EQ(substeps_at(4), planned);
  EXPECT_EQ(substeps_at(69), 4 * planned);
  EXPECT_EQ(substeps_at(70), 2 * planned);
  const Snapshot snapshot = simulation.snapshot();
  EXPECT_EQ(substeps_at(133), 2 * planned);
  EXPECT_EQ(substeps_at(134), planned);
  EXPECT_EQ(substeps_at(300), planned);
  EXPECT_THAT(simulation.repairs(), SizeIs(2)) << "growing is none";

  Simulation restored(scene);
  ASSERT_TRUE(restored.restore(snapshot));
  while (restored.frame() < 300) ASSERT_TRUE(restored.advance_frame());
  EXPECT_EQ(positions(restored), positions(simulation));

  Repairs repairs(scene.solver);
  StepPlan step = simulation.plan().step;
  repairs.adopt(2, {{5, 0, "", false}, {90, 0, "", false}});
  EXPECT_FALSE(repairs.grow(90 + 64 + 1, step));
  EXPECT_FALSE(repairs.grow(90 + 128 + 1, step)) << "twice the planned step is above its bound";
  step.substep /= 4;
  EXPECT_TRUE(repairs.grow(90 + 128 + 1, step));
  repairs.adopt(2, {});
  EXPECT_FALSE(repairs.grow(65, step)) << "nothing says since when";
  repairs.adopt(1, {{5, 0, "", true}});
  EXPECT_FALSE(repairs.grow(5 + 64 + 1, step)) << "where energy came from nothing it stays";
}

TEST(Guard, AFaultThatComesBackEndsTheRunWithTheLastGoodFrameReadable) {
  Scene scene = hung();
  scene.solver.max_repairs = 3;
  Simulation simulation(scene, faulty_solvers({.frame = 5, .times = 1000, .jump = kNan}));
  for (int frame = 1; frame < 5; ++frame) ASSERT_TRUE(simulation.advance_frame());
  const Matrix3Xd x = positions(simulation);
  EXPECT_FALSE(simulation.advance_frame());
  EXPECT_FALSE(simulation.advance_frame()) << "for good";
  EXPECT_EQ(simulation.frame(), 4);
  EXPECT_EQ(positions(simulation), x);
  EXPECT_THAT(simulation.repairs(), SizeIs(3));
  EXPECT_THAT(simulation.failure(), HasSubstr("frame 5"));
  EXPECT_THAT(simulation.failure(), HasSubstr("after 3 halvings"));
  EXPECT_THAT(simulation.failure(), HasSubstr("stopped being finite"));
  expect_finite(simulation);
}

TEST(Guard, AnUnstableStepIsHalvedUntilItIsStable) {
  Scene scene = hung();
  scene.solver.frame_step = 0.1;
  scene.solver.substep = 0.1;
  scene.solver.allow_unstable = true;
  scene.solver.precision = Precision::kSingle;
  Simulation simulation(scene);
  const double bound = simulation.plan().step.estimated_bound;
  for (int frame = 0; frame < 60; ++frame) {
    ASSERT_TRUE(simulation.advance_frame()) << simulation.failure();
    expect_finite(simulation);
    ASSERT_LT(simulation.stats().largest_strain, kMostStrain);
  }
  EXPECT_GE(simulation.repairs().size(), 6u) << "0.1 s is 2^7 times the bound";
  EXPECT_LT(simulation.plan().step.substep, 2 * bound);
}

TEST(Guard, EqualScenesAreRepairedToTheSameBits) {
  Scene scene = hung();
  scene.solver.frame_step = scene.solver.substep.emplace(0.02);
  scene.solver.allow_unstable = true;
  Simulation one(scene), other(scene);
  for (int frame = 0; frame < 20; ++frame) {
    other.release_memory();
    ASSERT_TRUE(one.advance_frame());
    ASSERT_TRUE(other.advance_frame());
  }
  EXPECT_FALSE(one.repairs().empty());
  EXPECT_EQ(one.repairs().size(), other.repairs().size());
  EXPECT_EQ(positions(one), positions(other));
}

TEST(Guard, RepairsOutliveAChangeOfTextile) {
  const Scene scene = hung();
  Simulation simulation(scene, faulty_solvers({.frame = 2, .times = 1, .jump = kNan}));
  const double planned = simulation.plan().step.substep;
  for (int frame = 0; frame < 3; ++frame) ASSERT_TRUE(simulation.advance_frame());
  ASSERT_FALSE(simulation.set_textile(0, paper_textile(1.1e-5)));
  EXPECT_LT(simulation.plan().step.substep, 0.6 * planned);
  ASSERT_TRUE(simulation.advance_frame());
  EXPECT_THAT(simulation.repairs(), SizeIs(1));
}

// A single thread of a soft textile with 2 m pulled out of it at 40 m/s: its strain is real.
TEST(Guard, AStrainThatAShorterStepConfirmsIsNoReasonForARepair) {
  SheetDefinition sheet = flat_sheet(2, 4, 0.05);
  sheet.textile.model = RawTextile{.particle_mass = 1e-3, .stretch = 20, .shear = 20};
  sheet.pins = {{{0, 4}, {}}, {{3, 7}, {{0, {0, 0, 0}}, {0.05, {2, 0, 0}}}}};
  Simulation simulation(floating(sheet)), packed(floating(sheet));
  const double planned = simulation.plan().step.substep;
  for (int frame = 0; frame < 20; ++frame) {
    packed.release_memory();
    ASSERT_TRUE(simulation.advance_frame());
    ASSERT_TRUE(packed.advance_frame());
    EXPECT_EQ(velocities(packed), velocities(simulation));
  }
  EXPECT_GT(simulation.stats().largest_strain, kMostStrain);
  EXPECT_THAT(simulation.repairs(), IsEmpty());
  EXPECT_EQ(simulation.plan().step.substep, planned);
}

TEST(Guard, WithoutRepairsOnlyWhatIsNotFiniteEndsARun) {
  Scene scene = hung();
  scene.solver.max_repairs = 0;
  scene.solver.frame_step = scene.solver.substep.emplace(0.005);
  scene.solver.allow_unstable = true;
  Simulation simulation(scene);
  int frames = 0;
  while (frames < 1000 && simulation.advance_frame()) ++frames;
  EXPECT_GT(frames, 3);
  EXPECT_LT(frames, 1000);
  EXPECT_THAT(simulation.failure(), HasSubstr("after 0 halvings"));
  expect_finite(simulation);
}

TEST(Guard, ASheetThatLiesStillWithoutWeightNeedsNoRepair) {
  SheetDefinition sheet = flat_sheet(11, 11);
  // places round to others in single precision, which strains the sheet
  Matrix3Xd x = start_positions(sheet);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.3, Vector3d(1, 2, 3).normalized()).matrix();
  for (auto at : x.colwise()) at = (turn * at).eval();
  sheet.start_positions = values(x);
  Scene scene = floating(sheet);
  scene.solver.precision = Precision::kSingle;
  Simulation simulation(scene);
  for (int frame = 0; frame < 10; ++frame) ASSERT_TRUE(simulation.advance_frame());
  EXPECT_THAT(simulation.repairs(), IsEmpty());
}

TEST(Guard, EnergyMayGrowByWhatTheSheetHadAndByWhatDrivesIt) {
  const Mesh mesh = make_lattice(flat_sheet(6, 6));
  const auto n = mesh.mass.size();
  const SheetState still{start_positions(flat_sheet(6, 6)), Matrix3Xd::Zero(3, n), 0};
  const auto moving = [&](double speed) {
    SheetState state = still;
    state.v.row(1).setConstant(speed);
    state.kinetic_energy = kinetic_energy(mesh, state.v);
    return state;
  };
  const Drive none{{0, 0, 0}, 0, 0.01}, weight{{0, -10, 0}, 0, 0.01}, pulled{{0, 0, 0}, 2, 0.01};
  const auto reason = [&](const Drive& drive, const SheetState& before, const SheetState& after) {
    return inspect(mesh, drive, kMostStrain, before, after).reason;
  };
  EXPECT_THAT(reason(none, still, moving(0.002)), HasSubstr("energy grew by"));
  EXPECT_EQ(reason(weight, still, moving(0.1)), "") << "what 0.01 s of gravity gives";
  EXPECT_NE(reason(weight, still, moving(1)), "");
  EXPECT_EQ(reason(pulled, still, moving(4)), "") << "twice the speed of a pin";
  EXPECT_NE(reason(pulled, still, moving(40)), "");
  const Drive hit{{0, 0, 0}, 0, 0.01, kinetic_energy(mesh, moving(1).v)};
  EXPECT_EQ(reason(hit, still, moving(1)), "") << "what hits it may leave it all its motion";
  EXPECT_NE(reason(hit, still, moving(1.1)), "");
  EXPECT_EQ(reason(none, moving(1), moving(1.4)), "") << "less than twice the energy";
  EXPECT_NE(reason(none, moving(1), moving(2)), "");
}

}  // namespace
}  // namespace weft::testing

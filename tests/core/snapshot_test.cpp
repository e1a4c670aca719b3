#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>
#include <random>

#include "core/simulation.h"
#include "tests/support/core/faulty_solver.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

// A crumpled sheet on two pins, one of them led about, that falls onto a ball that moves.
Scene busy() {
  SheetDefinition sheet = flat_sheet(7, 9, 0.05);
  sheet.textile = paper_textile();
  sheet.start_positions = values(start_positions(sheet) + 0.005 * noise(63));
  sheet.start_velocities = values(0.5 * noise(63, 2));
  sheet.pins = {{{0}, {{0, Vector3d::Zero()}, {0.4, Vector3d(0.05, 0.03, 0)}}}, {{8}, {}}};
  Scene scene = floating(sheet);
  scene.solver.precision = Precision::kSingle;
  scene.environment.gravity = {0, -9.8, 0};
  scene.colliders = {{"ball",
                      Sphere{Vector3d(0.2, -0.15, 0.15), 0.1},
                      0.3,
                      {{0, Vector3d::Zero()}, {1, Vector3d(0.2, 0.1, 0)}}}};
  return scene;
}

void advance(Simulation& simulation, int frames) {
  for (int i = 0; i < frames; ++i) ASSERT_TRUE(simulation.advance_frame());
}

void expect_equal_bits(const Matrix3Xd& a, const Matrix3Xd& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<std::size_t>(a.size())),
            0);
}

void expect_same(const Simulation& found, const Simulation& wanted) {
  const Snapshot a = found.snapshot(), b = wanted.snapshot();
  EXPECT_EQ(a.frame, b.frame);
  EXPECT_EQ(a.substeps, b.substeps);
  EXPECT_EQ(a.frames_at_rest, b.frames_at_rest);
  EXPECT_EQ(a.halvings, b.halvings);
  EXPECT_EQ(a.plan.step.substep, b.plan.step.substep);
  EXPECT_EQ(a.plan.step.estimated_bound, b.plan.step.estimated_bound);
  EXPECT_EQ(a.plan.step.unsheared_bound, b.plan.step.unsheared_bound);
  EXPECT_EQ(a.plan.step.slow_every, b.plan.step.slow_every);
  EXPECT_EQ(a.plan.passes, b.plan.passes);
  EXPECT_EQ(a.repairs.size(), b.repairs.size());
  EXPECT_EQ(found.stats().kinetic_energy, wanted.stats().kinetic_energy);
  EXPECT_EQ(found.stats().potential_energy, wanted.stats().potential_energy);
  ASSERT_EQ(a.sheets.size(), b.sheets.size());
  for (std::size_t s = 0; s < a.sheets.size(); ++s) {
    EXPECT_EQ(a.sheets[s].textile, b.sheets[s].textile);
    EXPECT_EQ(a.sheets[s].most_strain, b.sheets[s].most_strain);
    EXPECT_EQ(a.sheets[s].budget, b.sheets[s].budget);
    EXPECT_EQ(a.sheets[s].solver, b.sheets[s].solver);
    expect_equal_bits(a.sheets[s].x, b.sheets[s].x);
    expect_equal_bits(a.sheets[s].v, b.sheets[s].v);
  }
}

// Takes a snapshot of it and has a new simulation of `scene` go on from there beside it; the
// textile changes on the way.
void expect_to_go_on(Simulation& undisturbed, const Scene& scene, int frames = 12) {
  Simulation restored(scene);
  ASSERT_TRUE(restored.restore(undisturbed.snapshot()));
  for (int frame = 0; frame < frames; ++frame) {
    SCOPED_TRACE(frame);
    expect_same(restored, undisturbed);
    if (frame == frames / 2) {
      Textile textile = undisturbed.scene().sheets[0].textile;
      *textile.damping *= 1.5;
      ASSERT_FALSE(undisturbed.set_textile(0, textile));
      ASSERT_FALSE(restored.set_textile(0, textile));
    }
    advance(undisturbed, 1);
    advance(restored, 1);
  }
  expect_same(restored, undisturbed);
}

struct Variant {
  const char* name;
  std::function<void(Scene&)> set;
};

const Variant kVariants[] = {
    {"Default", [](Scene&) {}},
    {"NotCompensated", [](Scene& scene) { scene.solver.compensated = false; }},
    {"Double", [](Scene& scene) { scene.solver.precision = Precision::kDouble; }},
    {"Plain", [](Scene& scene) { scene.solver.plain = true; }},
    {"Euler",
     [](Scene& scene) {
       scene.solver.integrator = IntegratorKind::kEuler;
       scene.solver.frame_step = 1e-3;
       scene.solver.substep = 1e-5;
       scene.solver.allow_unstable = true;
     }},
    {"Midpoint",
     [](Scene& scene) {
       scene.solver.integrator = IntegratorKind::kMidpoint;
       scene.solver.frame_step = 1e-3;
       scene.solver.substep = 1e-5;
       scene.solver.allow_unstable = true;
     }},
    {"Rk4", [](Scene& scene) { scene.solver.integrator = IntegratorKind::kRk4; }},
    {"Exact",
     [](Scene& scene) { scene.sheets[0].bending = ChoiKo{.evaluator = Evaluator::kExact}; }},
    {"Isometric", [](Scene& scene) { scene.sheets[0].bending = Isometric{}; }},
    {"Wind",
     [](Scene& scene) {
       scene.environment.wind = Wind{.velocity = {3, 0, 1}, .gust = 0.5, .tangential_drag = 0.1};
     }},
    {"SelfWeightCap", [](Scene& scene) { scene.solver.max_self_weight_strain = 0.001; }},
    {"TwoSheets",
     [](Scene& scene) {
       scene.sheets.push_back(flat_sheet(5, 18));
       scene.sheets[1].name = "other";
     }},
    {"Tethered",
     [](Scene& scene) {
       std::get<RawTextile>(scene.sheets[0].textile.model).stretch = 50;
       scene.sheets[0].tether_stretch = 0;
     }},
    {"SlowForces",
     [](Scene& scene) {
       scene.sheets[0].bending = Isometric{};
       scene.environment.wind = Wind{.velocity = {1, 0, 1}};
       scene.solver.slow_forces_every = 4;
     }},
    {"UnshearedStep",
     [](Scene& scene) {
       scene.sheets[0].textile.damping_ratio = 0.02;
       scene.solver.step_bound = StepBound::kUnsheared;
     }},
};

class SnapshotOf : public ::testing::TestWithParam<Variant> {};

TEST_P(SnapshotOf, ASimulationGoesOnWithTheSameBits) {
  Scene scene = busy();
  GetParam().set(scene);
  Simulation simulation(scene);
  for (const int frames : {0, 1, 7}) {
    SCOPED_TRACE(frames);
    advance(simulation, frames);
    expect_to_go_on(simulation, scene);
  }
}

TEST_P(SnapshotOf, ASimulationPackedBetweenFramesIsThatOfOneThatWasNot) {
  Scene scene = busy();
  GetParam().set(scene);
  Simulation packed(scene), other(scene);
  Textile textile = scene.sheets[0].textile;
  *textile.damping *= 1.5;
  for (int frame = 0; frame < 12; ++frame) {
    SCOPED_TRACE(frame);
    if (frame == 6) {
      ASSERT_FALSE(packed.set_textile(0, textile));
      ASSERT_FALSE(other.set_textile(0, textile));
    }
    packed.release_memory();
    expect_same(packed, other);
    packed.release_memory();
    advance(packed, 1);
    advance(other, 1);
  }
  expect_same(packed, other);
}

// Says so by chance.
Enough now_and_then(std::mt19937& random) {
  return [&random] { return random() % 4 == 0; };
}

TEST_P(SnapshotOf, FramesInPartsAreThoseInOneGoAlsoWhereSomeAreDroppedOnTheWay) {
  Scene scene = busy();
  GetParam().set(scene);
  scene.solver.frame_step *= scene.solver.substep ? 12 : 40;  // long enough to be dropped
  std::mt19937 random(1);
  const Enough enough = now_and_then(random);
  Simulation in_parts(scene), other(scene);
  Textile textile = scene.sheets[0].textile;
  *textile.damping *= 1.5;
  int parts = 0, drops = 0;
  for (int frame = 0; frame < 4; ++frame) {
    SCOPED_TRACE(frame);
    if (frame == 1) {
      ASSERT_FALSE(in_parts.set_textile(0, textile, 2 * scene.solver.frame_step));
      ASSERT_FALSE(other.set_textile(0, textile, 2 * scene.solver.frame_step));
    }
    for (bool done = false; !done; ++parts) {
      const FramePart part = in_parts.advance_frame(enough);
      ASSERT_NE(part, FramePart::kFailed);
      done = part == FramePart::kDone;
      if (done) break;
      EXPECT_GT(in_parts.frame_share(), 0);
      EXPECT_LT(in_parts.frame_share(), 1);
      in_parts.release_memory();
      if (drops > 3 * frame + 2 || !in_parts.drop_frame()) continue;
      ++drops;
      EXPECT_EQ(in_parts.frame_share(), 0);
      expect_same(in_parts, other);
    }
    advance(other, 1);
    expect_same(in_parts, other);
  }
  EXPECT_GT(parts, 12);
  EXPECT_GT(drops, 4);
}

INSTANTIATE_TEST_SUITE_P(, SnapshotOf, ::testing::ValuesIn(kVariants),
                         [](const auto& each) { return each.param.name; });

TEST(Snapshot, HoldsAndLeadsOnWhatActionsHold) {
  using Kind = Action::Kind;
  const Scene scene = busy();
  Simulation simulation(scene);
  advance(simulation, 3);
  const Vector3d target = simulation.snapshot().sheets[0].x.col(30) + Vector3d(0.1, 0.2, 0);
  const std::vector<Action> actions = {
      {.kind = Kind::kGrab, .particle = 30, .hand = 3},
      {.kind = Kind::kDrag, .particle = 30, .target = target, .duration = 0.2, .hand = 3},
      {.kind = Kind::kPin, .particle = 60},
      {.kind = Kind::kUnpin, .particle = 8},
      {.kind = Kind::kMoveCollider, .name = "ball", .target = {0, 0.1, 0}, .duration = 0.2}};
  ASSERT_TRUE(simulation.problems_of(actions).empty());
  ASSERT_FALSE(simulation.act(actions));
  advance(simulation, 2);
  Simulation restored(scene);
  ASSERT_TRUE(restored.restore(simulation.snapshot()));
  const Action let_go{.kind = Kind::kLetGo, .hand = 3};
  for (int frame = 0; frame < 20; ++frame) {
    SCOPED_TRACE(frame);
    expect_same(restored, simulation);
    if (frame == 12) {
      ASSERT_FALSE(simulation.act({let_go}));
      ASSERT_FALSE(restored.act({let_go}));
    }
    advance(simulation, 1);
    advance(restored, 1);
  }
}

TEST(Snapshot, AFrameThatIsRepairedInPartsIsTheOneInOneGo) {
  Scene scene = busy();
  scene.solver.frame_step *= 40;
  const Fault fault{.frame = 2, .times = 2, .jump = std::numeric_limits<double>::quiet_NaN()};
  Simulation in_parts(scene, faulty_solvers(fault)), other(scene, faulty_solvers(fault));
  std::mt19937 random(1);
  for (int frame = 0; frame < 3; ++frame) {
    FramePart part = FramePart::kUnfinished;
    while (part == FramePart::kUnfinished) part = in_parts.advance_frame(now_and_then(random));
    ASSERT_EQ(part, FramePart::kDone);
    advance(other, 1);
    expect_same(in_parts, other);
  }
  EXPECT_EQ(other.repairs().size(), 2);
}

TEST(Snapshot, NeitherAPlanNorARepairExceedsTheWorkThatAFrameMayCost) {
  Scene scene = busy();
  Simulation simulation(scene, faulty_solvers({.frame = 2, .times = 9, .jump = 1e9}));
  const std::int64_t planned = simulation.plan().step.substeps;
  simulation.limit_frame_work(63 * planned - 1);
  ASSERT_TRUE(simulation.refusal());
  EXPECT_TRUE(simulation.refusal()->too_many_substeps);
  EXPECT_EQ(simulation.refusal()->substeps, planned);
  EXPECT_EQ(simulation.refusal()->most_substeps, planned - 1);

  simulation.limit_frame_work(63 * 2 * planned);
  ASSERT_FALSE(simulation.refusal());
  Textile stiff = scene.sheets[0].textile;
  std::get<RawTextile>(stiff.model).stretch *= 100;
  const auto refused = simulation.set_textile(0, stiff);
  ASSERT_TRUE(refused);
  EXPECT_TRUE(refused->too_many_substeps);
  advance(simulation, 1);
  EXPECT_FALSE(simulation.advance_frame());
  EXPECT_EQ(simulation.repairs().size(), 1);
}

TEST(Snapshot, GoesOnInTheMiddleOfAChangeOfTextile) {
  const Scene scene = busy();
  Simulation simulation(scene);
  Textile textile = scene.sheets[0].textile;
  *textile.damping *= 2;
  std::get<RawTextile>(textile.model).stretch /= 3;
  ASSERT_FALSE(simulation.set_textile(0, textile, 10 * scene.solver.frame_step));
  advance(simulation, 4);
  Simulation restored(scene);
  ASSERT_TRUE(restored.restore(simulation.snapshot()));
  for (int frame = 0; frame < 10; ++frame) {
    SCOPED_TRACE(frame);
    expect_same(restored, simulation);
    advance(simulation, 1);
    advance(restored, 1);
  }
  EXPECT_EQ(restored.scene().sheets[0].textile, textile);
}

TEST(Snapshot, OfASleepingSceneSleepsOnAndWakesAlike) {
  Scene scene = busy();
  scene.colliders.clear();
  std::get<RawTextile>(scene.sheets[0].textile.model).air_drag = 0.02;
  Simulation simulation(scene);
  while (!simulation.asleep() && simulation.time() < 100) advance(simulation, 1);
  ASSERT_TRUE(simulation.asleep());
  advance(simulation, 3);
  expect_to_go_on(simulation, scene);
}

TEST(Snapshot, RemembersRepairs) {
  const Scene scene = busy();
  Simulation simulation(scene, faulty_solvers({.frame = 5, .times = 1, .jump = 1e3}));
  advance(simulation, 5);
  ASSERT_EQ(simulation.repairs().size(), 1u);
  expect_to_go_on(simulation, scene);
}

TEST(Snapshot, ThatDoesNotFitTheSceneIsRefusedAndChangesNothing) {
  Simulation simulation(busy());
  advance(simulation, 3);
  const Snapshot good = simulation.snapshot();
  const std::function<void(Snapshot&)> faults[] = {
      [](Snapshot& s) { s.sheets.clear(); },
      [](Snapshot& s) { s.sheets.push_back(s.sheets[0]); },
      [](Snapshot& s) { s.sheets[0].x.resize(3, 62); },
      [](Snapshot& s) { s.sheets[0].v.resize(3, 0); },
      [](Snapshot& s) { s.sheets[0].v(1, 7) = std::numeric_limits<double>::quiet_NaN(); },
      [](Snapshot& s) { s.sheets[0].most_strain = 0; },
      [](Snapshot& s) {
        s.sheets[0].ramp = {paper_textile(), paper_textile(), 0, s.frame};
      },
      [](Snapshot& s) {
        s.sheets[0].ramp = {paper_textile(), paper_textile(), s.frame + 1, 9};
      },
      [](Snapshot& s) {
        s.sheets[0].ramp = {paper_textile(), Textile(), 0, 9};
      },
      [](Snapshot& s) {
        s.sheets[0].ramp = {paper_textile(-1), paper_textile(), 0, 9};
      },
      [](Snapshot& s) { s.sheets[0].solver.pop_back(); },
      [](Snapshot& s) { s.sheets[0].solver += '\0'; },
      [](Snapshot& s) { s.sheets[0].solver.clear(); },
      [](Snapshot& s) { s.sheets[0].textile.damping = -1; },
      [](Snapshot& s) { s.frame = -1; },
      [](Snapshot& s) { s.frames_at_rest = -1; },
      [](Snapshot& s) { s.halvings = -1; },
      [](Snapshot& s) { s.halvings = 13; },
      [](Snapshot& s) { s.plan.step.substeps = 0; },
      [](Snapshot& s) { s.plan.step.substeps *= 2; },
      [](Snapshot& s) { s.plan.step.substep = 0; },
      [](Snapshot& s) { s.plan.step.linear_bound = s.plan.step.substep / 2; },
  };
  for (std::size_t i = 0; i < std::size(faults); ++i) {
    SCOPED_TRACE(i);
    Snapshot bad = good;
    faults[i](bad);
    EXPECT_FALSE(simulation.restore(bad));
  }
  for (const std::size_t other : {1U, 2U, 3U, 11U}) {
    Scene scene = busy();
    kVariants[other].set(scene);
    EXPECT_FALSE(Simulation(scene).restore(good)) << kVariants[other].name;
  }
  Simulation undisturbed(busy());
  advance(undisturbed, 3);
  expect_same(simulation, undisturbed);
}

}  // namespace
}  // namespace weft::testing

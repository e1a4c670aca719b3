#include "core/model/actions.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numeric>

#include "core/simulation.h"
#include "tests/support/core/bodies.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

using ::testing::IsEmpty;
using Kind = Action::Kind;

// 7 x 7 particles, hung by two corners, 0 and 6.
Scene curtain() {
  SheetDefinition sheet = flat_sheet(7, 7, 0.05);
  sheet.rotation = Quaterniond(Eigen::AngleAxisd(1.5, Vector3d::UnitX()));
  sheet.pins = {{{0, 6}, {}}};
  Scene scene = floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  return scene;
}

Action act(Kind kind, int particle) { return {.kind = kind, .particle = particle}; }
Action drag(int particle, const Vector3d& target, std::optional<double> duration = {}) {
  return {.kind = Kind::kDrag, .particle = particle, .target = target, .duration = duration};
}

void expect_done(Simulation& simulation, const std::vector<Action>& actions) {
  for (const auto& [field, message] : simulation.problems_of(actions))
    ADD_FAILURE() << field << ": " << message;
  EXPECT_FALSE(simulation.act(actions));
}

void advance(Simulation& simulation, int frames) {
  for (int i = 0; i < frames; ++i) ASSERT_TRUE(simulation.advance_frame());
}

class Handled : public ::testing::TestWithParam<IntegratorKind> {
 protected:
  Handled() {
    Scene scene = curtain();
    scene.solver.integrator = GetParam();
    simulation_.emplace(scene);
    advance(*simulation_, 5);
  }
  std::optional<Simulation> simulation_;
};
INSTANTIATE_TEST_SUITE_P(, Handled,
                         ::testing::Values(IntegratorKind::kVerlet, IntegratorKind::kRk4));

TEST_P(Handled, AGrabbedCornerFollowsItsTargetAndItsNeighboursFeelIt) {
  Simulation still = Simulation(simulation_->scene());
  advance(still, 20);
  const Vector3d from = positions(*simulation_).col(48);
  const Vector3d to = from + Vector3d(0.1, 0.2, 0.3);
  expect_done(*simulation_, {act(Kind::kGrab, 48), drag(48, to, 0.1)});
  for (int frame = 0; frame < 15; ++frame) {
    advance(*simulation_, 1);
    const Vector3d wanted = from + std::min(1.0, simulation_->time() / 0.1 - 0.5) * (to - from);
    ASSERT_LT((positions(*simulation_).col(48) - wanted).norm(), 1e-12);
  }
  EXPECT_LT(velocities(*simulation_).col(48).norm(), 1e-12);
  EXPECT_GT((positions(*simulation_) - positions(still)).col(41).norm(), 0.01);
}

TEST_P(Handled, AReleasedParticleGoesOnWithTheVelocityOfTheHand) {
  const Vector3d from = positions(*simulation_).col(48);
  const Vector3d u(0.3, 0.6, 0);
  expect_done(*simulation_, {act(Kind::kGrab, 48), drag(48, from + u, 1.0)});
  advance(*simulation_, 3);
  expect_done(*simulation_, {act(Kind::kRelease, 48)});
  EXPECT_LT((velocities(*simulation_).col(48) - u).norm(), 1e-6);
  const double dt = simulation_->plan().step.substep;
  advance(*simulation_, 1);
  EXPECT_GT((velocities(*simulation_).col(48) - u).norm(), 1e-3) << "it is free";
  EXPECT_EQ(simulation_->plan().step.substep, dt);
  EXPECT_THAT(simulation_->repairs(), IsEmpty());
}

TEST_P(Handled, APinnedParticleMayBeDraggedAndStaysWhereItIsReleased) {
  expect_done(*simulation_, {act(Kind::kGrab, 6), drag(6, {0.2, 0.1, 0})});
  advance(*simulation_, 2);
  expect_done(*simulation_, {act(Kind::kRelease, 6)});
  advance(*simulation_, 5);
  EXPECT_LT((positions(*simulation_).col(6) - Vector3d(0.2, 0.1, 0)).norm(), 1e-12);
  expect_done(*simulation_, {act(Kind::kPin, 48), act(Kind::kUnpin, 6)});
  const Vector3d pinned = positions(*simulation_).col(48);
  advance(*simulation_, 5);
  EXPECT_GT((positions(*simulation_).col(6) - Vector3d(0.2, 0.1, 0)).norm(), 1e-3);
  EXPECT_LT((positions(*simulation_).col(48) - pinned).norm(), 1e-12);
}

// Pins lengthen the stable step; grabs do not, so that it need not shorten when they end.
TEST(Actions, PlansTheStepForWhatIsPinned) {
  Scene scene = curtain();
  Simulation free(scene);
  std::vector<Action> pins;
  for (int i = 1; i < 49; ++i)
    if (i != 6) pins.push_back(act(Kind::kPin, i));
  Simulation simulation(scene);
  expect_done(simulation, pins);
  EXPECT_GT(simulation.plan().step.linear_bound, 1.5 * free.plan().step.linear_bound);
  for (Action& action : pins) action.kind = Kind::kUnpin;
  expect_done(simulation, pins);
  EXPECT_EQ(simulation.plan().step.linear_bound, free.plan().step.linear_bound);
  for (Action& action : pins) action.kind = Kind::kGrab;
  expect_done(simulation, pins);
  EXPECT_EQ(simulation.plan().step.linear_bound, free.plan().step.linear_bound);

  // a step that was asked for is refused where it would be too long, and nothing is changed
  scene.sheets[0].pins[0].particles.resize(49);
  std::iota(scene.sheets[0].pins[0].particles.begin(), scene.sheets[0].pins[0].particles.end(), 0);
  scene.solver.substep = scene.solver.frame_step;
  Simulation held(scene);
  ASSERT_FALSE(held.refusal());
  EXPECT_TRUE(held.act({act(Kind::kUnpin, 3)}));
  EXPECT_EQ(held.constraints().pins[0][0].particles.size(), 49);
}

TEST(Actions, AtItsLargestSpeedBreaksNoFrame) {
  for (const double stretch : {2000.0, 20.0}) {
    Scene scene = curtain();
    std::get<RawTextile>(scene.sheets[0].textile.model).stretch = stretch;
    Simulation simulation(scene);
    advance(simulation, 2);
    const Vector3d from = positions(simulation).col(48);
    expect_done(simulation, {act(Kind::kGrab, 48), drag(48, from + Vector3d(0, 1, 2))});
    advance(simulation, 12);
    EXPECT_LT((positions(simulation).col(48) - from - Vector3d(0, 1, 2)).norm(), 1e-12);
    expect_done(simulation, {drag(48, from)});
    advance(simulation, 7);
    expect_done(simulation, {act(Kind::kRelease, 48)});
    advance(simulation, 20);
    EXPECT_THAT(simulation.repairs(), IsEmpty());
  }
}

TEST(Actions, WakesASleepingScene) {
  Scene scene = curtain();
  scene.sheets[0].textile.damping = 0.02;
  std::get<RawTextile>(scene.sheets[0].textile.model).air_drag = 0.01;
  scene.colliders = {{"ball", Sphere{Vector3d(0.15, -0.15, 0.4), 0.1}, 0.3, {}}};
  Simulation simulation(scene);
  const auto sleep = [&] {
    while (!simulation.asleep() && simulation.time() < 60) advance(simulation, 1);
    ASSERT_TRUE(simulation.asleep());
  };
  sleep();
  const Matrix3Xd before = positions(simulation);
  expect_done(simulation, {{.kind = Kind::kMoveCollider, .target = {0, 0, -0.5}, .duration = 0.2}});
  advance(simulation, 20);
  EXPECT_GT(simulation.substeps(), 0);
  EXPECT_GT((positions(simulation) - before).colwise().norm().maxCoeff(), 0.05) << "it is pushed";
  sleep();
  expect_done(simulation, {act(Kind::kGrab, 48)});
  EXPECT_FALSE(simulation.asleep());
}

TEST(Actions, OfOneSheetChangesNoBitOfAnother) {
  Scene scene = curtain();
  scene.sheets.push_back(scene.sheets[0]);
  scene.sheets[1].name = "other";
  Simulation left(scene), handled(scene);
  advance(left, 5);
  advance(handled, 5);
  expect_done(handled, {{.kind = Kind::kGrab, .name = "other", .particle = 20}});
  advance(left, 5);
  advance(handled, 5);
  const Matrix3Xd a = positions(left), b = positions(handled);
  EXPECT_EQ(a.leftCols(49), b.leftCols(49));
  EXPECT_NE(a, b);
}

TEST(Actions, SaysWhatIsWrongWithActions) {
  Scene scene = curtain();
  scene.colliders = {{"ball", Sphere{Vector3d(5, 0, 0), 0.1}, 0.3, {}}};
  Simulation simulation(scene);
  const Matrix3Xd x = positions(simulation);
  const auto problem = [&](const Action& action) {
    const auto problems = simulation.problems_of({act(Kind::kGrab, 9), action});
    return problems.empty() ? "" : problems[0].field + ": " + problems[0].message;
  };
  EXPECT_EQ(problem(act(Kind::kGrab, 49)), "actions[1].grab.particle: 49 is not within 0 to 48");
  EXPECT_EQ(problem(act(Kind::kGrab, 9)), "actions[1].grab.particle: 9 is grabbed already");
  EXPECT_EQ(problem(act(Kind::kRelease, 8)), "actions[1].release.particle: 8 is not grabbed");
  EXPECT_EQ(problem(act(Kind::kPin, 6)), "actions[1].pin.particle: 6 is pinned already");
  EXPECT_EQ(problem(act(Kind::kUnpin, 9)), "actions[1].unpin.particle: 9 is not pinned");
  EXPECT_EQ(problem({.kind = Kind::kPin, .name = "no"}),
            "actions[1].pin.sheet: \"no\" is none of the sheets: sheet");
  EXPECT_EQ(problem({.kind = Kind::kMoveCollider, .name = "no"}),
            "actions[1].move_collider.collider: \"no\" is none of the colliders: ball");
  EXPECT_EQ(problem(drag(9, {std::nan(""), 0, 0})),
            "actions[1].drag.target_m.x: nan m is not within -10000 to 10000 m");
  EXPECT_EQ(problem(drag(9, x.col(9), 0)),
            "actions[1].drag.duration_s: 0 s is not within 1e-06 to "
            "10000 s");
  EXPECT_EQ(problem(drag(9, Vector3d(x.col(9)) + Vector3d(3, 0, 0), 0.1)),
            "actions[1].drag.duration_s: 0.1 s is too short for 3 m: at 20 m/s, the most, they "
            "take 0.15 s");
  EXPECT_EQ(
      problem(drag(9, {-1e4, 1e4, 0}, 1000)),
      "actions[1].drag.target_m: lies 14.14 km from the particle's start; a path reaches 10 km "
      "along each axis");
  Action stream = act(Kind::kRelease, 9);
  stream.hand = 1;
  EXPECT_EQ(problem(stream), "actions[1].release.particle: 9 is grabbed by another stream or call");
  EXPECT_EQ(problem(drag(9, Vector3d(x.col(9)) + Vector3d(3, 0, 0))), "");
}

// A patch on a box whose upper side rises by 0.2 m within a second, from 10 s on.
Scene lid() {
  SheetDefinition sheet = flat_sheet(7, 7, 0.02);
  sheet.origin = {-0.06, 0.0511, -0.06};
  sheet.skin = 1e-3;
  Scene scene = floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  scene.colliders = {
      posed(box_mesh({0.2, 0.05, 0.2}), {10, 11, 12}, [](const Vector3d& vertex, double time) {
        return Vector3d(vertex + Vector3d(0, vertex.y() > 0 ? 0.2 * (time - 10) : 0, 0));
      })};
  return scene;
}

Action pose(double time, double speed) {
  return {.kind = Kind::kPoseCollider, .pose_time = time, .pose_speed = speed};
}

TEST(Actions, LeadABodyThroughItsPosesAtASpeedThereAndBackAndItStays) {
  Simulation simulation(lid());
  advance(simulation, 30);
  const double start = positions(simulation).row(1).mean();
  EXPECT_NEAR(start, 0.051, 1e-3) << "long before its poses it stands in the first";
  double height = 0.1;  // of the upper side, m
  const auto lead = [&](double to, double speed) {
    expect_done(simulation, {pose(10 + to / 0.2, speed)});
    const double from = height - 0.1, begin = simulation.time();
    const double needed = std::abs(to - from) / speed;
    while (simulation.time() < begin + needed + 0.5) {
      advance(simulation, 1);
      const double share = std::min(1.0, (simulation.time() - begin) / needed);
      height = 0.1 + from + share * (to - from);
      const Matrix3Xd x = positions(simulation);
      EXPECT_GE(x.row(1).minCoeff(), height - 0.05 + 0.5e-3) << simulation.time();
      if (to > from) {
        EXPECT_LE(x.row(1).maxCoeff(), height - 0.05 + 0.02) << simulation.time();
      }
    }
    EXPECT_NEAR(positions(simulation).row(1).mean(), start + to, 1e-3);
  };
  lead(0.3, 0.4);
  lead(0.1, 0.2);
  lead(0, 1);
  lead(0.4, 0.1);
}

TEST(Actions, ALedBodyGoesOnFromASnapshotToTheBit) {
  Simulation simulation(lid());
  advance(simulation, 10);
  expect_done(simulation, {pose(11.5, 0.5)});
  advance(simulation, 10);
  const Snapshot snapshot = simulation.snapshot();
  Simulation other(lid());
  ASSERT_TRUE(other.restore(snapshot));
  advance(simulation, 30);
  advance(other, 30);
  EXPECT_EQ(positions(simulation), positions(other));
  EXPECT_NEAR(positions(other).row(1).mean(), 0.051 + 0.2, 1e-3);
  Snapshot beyond = snapshot;
  beyond.constraints.leads[0]->to = 13;
  EXPECT_FALSE(other.restore(beyond));
}

TEST(Actions, ClearanceIsFromABodyWhereItIsLed) {
  Simulation simulation(lid());
  expect_done(simulation, {pose(12, 20)});
  advance(simulation, 5);
  FrameMeter meter(simulation.scene());
  const std::vector<double> above{0, 0.6, 0};
  const auto found = meter.clearances(simulation.scene_of_frame(), above, simulation.time());
  EXPECT_NEAR(found[0], 0.6 - 0.45, 1e-6);
}

TEST(Actions, SayWhatIsWrongWithPoses) {
  Scene scene = lid();
  scene.colliders.push_back({"ball", Sphere{Vector3d(5, 0, 0), 0.1}, 0.3, {}});
  const auto problem = [&](const Action& action) {
    const auto problems = Simulation(scene).problems_of({action});
    return problems.empty() ? "" : problems[0].field + ": " + problems[0].message;
  };
  Action led = pose(13, 1);
  led.name = "body";
  EXPECT_EQ(problem(led),
            "actions[0].pose_collider.pose_time_s: 13 s is not within its poses, 10 to 12 s");
  led.pose_time = std::nan("");
  EXPECT_EQ(problem(led),
            "actions[0].pose_collider.pose_time_s: nan s is not within its poses, 10 to 12 s");
  led.pose_time = 11;
  led.pose_speed = 21;
  EXPECT_EQ(problem(led),
            "actions[0].pose_collider.speed_m_per_s: 21 m/s is not within 0.01 to 20 m/s");
  led.pose_speed = 1;
  EXPECT_EQ(problem(led), "");
  led.name = "ball";
  EXPECT_EQ(problem(led),
            "actions[0].pose_collider.collider: \"ball\" has no poses to be led through");
  led.name = "";
  EXPECT_EQ(problem(led),
            "actions[0].pose_collider.collider: \"\" is none of the colliders: body, ball");
}

}  // namespace
}  // namespace weft::testing

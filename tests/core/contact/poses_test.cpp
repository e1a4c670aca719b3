#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "core/contact/contact.h"
#include "core/contact/moving_bodies.h"
#include "tests/support/core/bodies.h"
#include "tests/support/core/last_first.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

Vector3d turned(const Vector3d& v, double angle, const Vector3d& axis = Vector3d::UnitY()) {
  return Eigen::AngleAxisd(angle, axis.normalized()) * v;
}

std::vector<double> every(double step, double end, double begin = 0) {
  std::vector<double> times;
  for (int i = 0; begin + i * step < end + step / 2; ++i) times.push_back(begin + i * step);
  return times;
}

// Of points within a centimetre of the surface, cells.
struct Errors {
  double worst = 0, mean = 0;  // root of the mean square
};

// distance_at: the exact one.
template <class F>
Errors errors_of(const Collider& body, double time, const F& distance_at) {
  const double cell = std::get<SharedBody>(body.shape)->grid.cell;
  const std::vector<Collider> colliders{body};
  MovingBodies bodies(colliders);
  bodies.place(colliders, time, 1e-4);
  const BodyMesh mesh = mesh_at(body, time);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Errors errors;
  constexpr int kPoints = 60;
  for (int i = 0; i < kPoints; ++i) {
    const auto& triangle = mesh.triangles[random() % mesh.triangles.size()];
    const double share = std::abs(uniform(random));
    const Vector3d on =
        share * corner_of(mesh, triangle, 0) +
        (1 - share) / 2 * (corner_of(mesh, triangle, 1) + corner_of(mesh, triangle, 2));
    const Vector3d point = on + 0.005 * Vector3d(uniform(random), uniform(random), uniform(random));
    const double error =
        (distance(body, point, time, bodies.of(0)).value - distance_at(mesh, point)) / cell;
    errors.worst = std::max(errors.worst, std::abs(error));
    errors.mean += error * error / kPoints;
  }
  errors.mean = std::sqrt(errors.mean);
  return errors;
}

Way going_turning_growing(double turns) {
  return [=](const Vector3d& vertex, double time) {
    return Vector3d(turned((1 + 0.3 * time) * vertex, turns * time, Vector3d(1, 2, 3)) +
                    time * Vector3d(2, 0.5, 0));
  };
}

TEST(Poses, OfABallThatGoesTurnsAndGrowsAreATenthOfACellFromTheBall) {
  const double radius = 0.1;
  const Collider ball = posed(ball_mesh(radius, 4), every(0.02, 0.4), going_turning_growing(3));
  for (const double time : {0.01, 0.137, 0.2, 0.333, 0.4, 0.5}) {
    const double t = std::min(time, 0.4);
    const auto exact = [&](const BodyMesh&, const Vector3d& point) {
      return (point - t * Vector3d(2, 0.5, 0)).norm() - radius * (1 + 0.3 * t);
    };
    const Errors errors = errors_of(ball, time, exact);
    EXPECT_LT(errors.worst, 0.25) << time;
    EXPECT_LT(errors.mean, 0.1) << time;
  }
}

// Half a metre long along z; beyond its middle it is bent about x.
Collider arm(double bend_per_s, const std::vector<double>& times) {
  BodyMesh mesh = ball_mesh(0.04, 3);
  for (Vector3d& v : mesh.vertices) v.z() *= 6;
  return posed(mesh, times, [=](const Vector3d& vertex, double time) {
    const double bent = std::clamp(vertex.z() / 0.1, 0.0, 1.0);
    return turned(vertex, -bend_per_s * time * bent, Vector3d::UnitX());
  });
}

TEST(Poses, OfAnArmThatBendsAreAsNearToItsTrianglesAsThoseOfABodyAtRest) {
  const Collider body = arm(3, every(0.05, 0.5));
  for (const double time : {0.02, 0.225, 0.31, 0.49}) {
    const Errors errors = errors_of(body, time, signed_distance);
    EXPECT_LT(errors.worst, 1 / 3.0) << time;
    EXPECT_LT(errors.mean, 0.1) << time;
  }
}

// Farther than that the values are only bounds.
TEST(Poses, SayNoMoreThanTheWayToTheBodyAndWhichSideAPointIsOn) {
  const Collider body = arm(3, every(0.05, 0.5));
  const std::vector<Collider> colliders{body};
  MovingBodies bodies(colliders);
  for (const double time : {0.1, 0.23}) {
    bodies.place(colliders, time, 1e-4);
    const BodyMesh mesh = mesh_at(body, time);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(-0.3, 0.3);
    const double cell = std::get<SharedBody>(body.shape)->grid.cell;
    int inside = 0;
    for (int i = 0; i < 60; ++i) {
      const double near = i % 2 == 0 ? 0.04 : 1;
      const Vector3d point(near * uniform(random), near * uniform(random), uniform(random));
      const double value = distance(body, point, time, bodies.of(0)).value,
                   exact = signed_distance(mesh, point);
      EXPECT_LE(value, std::max(exact, 0.0) + cell / 2) << point.transpose();
      if (std::abs(exact) > cell / 2) {
        EXPECT_EQ(value < 0, exact < 0) << point.transpose();
      }
      inside += exact < 0 ? 1 : 0;
    }
    EXPECT_GT(inside, 5);
  }
}

Scene resting_on(const Collider& body, int columns = 15, double spacing = 0.01) {
  SheetDefinition sheet = flat_sheet(columns, columns, spacing);
  const double half = (columns - 1) * spacing / 2;
  sheet.origin = {-half, 1.05e-3, -half};
  sheet.skin = 1e-3;
  sheet.textile.damping = 0.02;
  sheet.textile.friction = 1;
  Scene scene = floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  scene.colliders = {body};
  return scene;
}

// Its upper face is at y = 0.
Collider table(const Way& way, const std::vector<double>& times) {
  BodyMesh mesh = box_mesh({0.2, 0.03, 0.2});
  for (Vector3d& v : mesh.vertices) v.y() -= 0.03;
  return posed(mesh, times, way, 5e-3, 1);
}

TEST(Poses, OfATableThatSlidesTakeAlongWhatLiesOnIt) {
  Simulation simulation(resting_on(table(
      [](const Vector3d& vertex, double time) {
        const double t = time - 0.2;  // a half of gravity's friction
        return Vector3d(vertex + Vector3d(2.5 * t * t, 0.1 * t, 0));
      },
      every(0.005, 0.6, 0.2))));
  const Matrix3Xd start = positions(simulation);
  while (simulation.time() < 0.595) ASSERT_TRUE(simulation.advance_frame());
  const Matrix3Xd way = positions(simulation) - start;
  const double t = simulation.time() - 0.2;
  EXPECT_LT((way.row(0).array() - 2.5 * t * t).abs().maxCoeff(), 5e-3);
  EXPECT_LT((way.row(1).array() - 0.1 * t).abs().maxCoeff(), 1e-4);
  EXPECT_LT(way.row(2).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(Poses, OfATableThatTurnsTurnWhatLiesOnIt) {
  Simulation simulation(resting_on(
      table([](const Vector3d& vertex, double time) { return turned(vertex, time * time); },
            every(0.02, 1))));
  const Matrix3Xd start = positions(simulation);
  while (simulation.time() < 0.995) ASSERT_TRUE(simulation.advance_frame());
  const Matrix3Xd x = positions(simulation);
  const double angle = std::pow(simulation.time(), 2);
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    EXPECT_LT((x.col(i) - turned(start.col(i), angle)).norm(), 5e-3) << i;
}

// A ball that comes up from below at 5 m/s, swells and shrinks.
Collider leaping_ball() {
  return posed(ball_mesh(0.1, 3), every(0.02, 0.4, 0.05), [](const Vector3d& vertex, double time) {
    const double t = time - 0.05;
    return Vector3d((1 + 0.4 * std::sin(20 * t)) * vertex +
                    Vector3d(0.1 * t, 0.5 * std::sin(10 * t) - 0.11, 0));
  });
}

TEST(Poses, NeverPassThroughASheet) {
  Scene scene = resting_on(leaping_ball(), 25);
  Simulation simulation(scene);
  while (simulation.time() < 0.5) {
    ASSERT_TRUE(simulation.advance_frame());
    MovingBodies bodies(scene.colliders);
    bodies.place(scene.colliders, simulation.time(), 1e-4);
    const Matrix3Xd x = positions(simulation);
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      ASSERT_GT(distance(scene.colliders[0], x.col(i), simulation.time(), bodies.of(0)).value,
                0.95e-3)
          << simulation.time();
  }
}

TEST(Poses, ThatAreFarAreSkippedWithoutMissingAContact) {
  Scene scene = resting_on(leaping_ball());
  scene.solver.precision = Precision::kDouble;
  Simulation fast(scene);
  scene.solver.plain = true;
  Simulation plain(scene);
  for (int frame = 0; frame < 20; ++frame) {
    ASSERT_TRUE(fast.advance_frame());
    ASSERT_TRUE(plain.advance_frame());
    ASSERT_LE((positions(fast) - positions(plain)).cwiseAbs().maxCoeff(), 1e-9) << frame;
  }
}

Matrix3Xd run_leap(ThreadPool& pool = calling_thread(), bool with_snapshot = false) {
  const Scene scene = resting_on(leaping_ball(), 25);
  Simulation simulation(scene);
  for (int frame = 0; frame < 20; ++frame) {
    EXPECT_TRUE(simulation.advance_frame(pool));
    if (!with_snapshot || frame != 9) continue;
    Simulation other(scene);
    EXPECT_TRUE(other.restore(simulation.snapshot()));
    simulation = std::move(other);
  }
  return positions(simulation);
}

TEST(Poses, GiveTheSameBitsInVectorsOfEveryWidthOnSeveralThreadsAndAfterASnapshot) {
  LastFirst three(3);
  const Matrix3Xd wanted = run_leap();
  EXPECT_EQ(run_leap(three), wanted);
  EXPECT_EQ(run_leap(calling_thread(), true), wanted);
  for (const std::int64_t target : {HWY_AVX2, HWY_AVX3}) {
    if ((hwy::SupportedTargets() & target) == 0) continue;
    hwy::SetSupportedTargetsForTest(target);
    EXPECT_EQ(run_leap(), wanted) << hwy::TargetName(target);
    hwy::SetSupportedTargetsForTest(0);
  }
}

TEST(Poses, WakeASheetThatLiesStillOnlyAsLongAsTheyChange) {
  Simulation simulation(resting_on(
      table([](const Vector3d& vertex,
               double time) { return Vector3d(vertex + Vector3d(0, 0.02 * (time - 2), 0)); },
            {2, 2.5}),
      5));
  while (simulation.time() < 2.4) {
    ASSERT_TRUE(simulation.advance_frame());
    EXPECT_FALSE(simulation.at_rest());
  }
  for (int frame = 0; frame < 120 && !simulation.at_rest(); ++frame)
    ASSERT_TRUE(simulation.advance_frame());
  EXPECT_TRUE(simulation.at_rest());
  EXPECT_TRUE(simulation.repairs().empty());
  EXPECT_NEAR(positions(simulation)(1, 12), 0.01 + 1e-3, 1e-5);
}

// A grid for each cell that its surface goes past its middle, and none anew where it keeps its
// shape.
TEST(Poses, HaveTheirGridsCountedInThePlan) {
  // grows by 12 mm to the second pose, in cells of 5 mm, and stays like that
  const auto way = [](const Vector3d& vertex, double time) {
    return Vector3d((1 + 0.12 * std::min(time, 1.0)) * vertex);
  };
  Scene scene = floating(flat_sheet(2, 2));
  scene.colliders = {posed(ball_mesh(0.1, 2), {0, 1, 2, 3}, way)};
  scene.colliders[0].name = "ball";
  const Plan plan = Simulation(scene).plan();
  EXPECT_THAT(plan.passes,
              ::testing::Contains("ball: 4 poses, 4 grids of 320 triangles, cells of 0.005 m"));
}

TEST(Poses, HaveCellsThatTheirLargestOneCanBear) {
  const Collider ball = posed(ball_mesh(0.1, 2), {0, 1}, [](const Vector3d& v, double time) {
    return Vector3d(v * (1 + 9 * time));
  });
  const auto& triangles = std::get<SharedBody>(ball.shape)->mesh.triangles;
  const double least = least_pose_cell(*ball.poses, triangles);
  EXPECT_NEAR(4 * std::numbers::pi / (least * least), 2e5,
              2e4);  // squares of a cell on its surface
}

std::string fault(const Poses& poses, std::size_t vertices) {
  const auto problems = find_problems(poses, vertices, "poses");
  return problems.empty() ? "" : problems[0].field + ": " + problems[0].message;
}

TEST(Poses, ThatAreWrongAreToldWithPoseAndVertex) {
  Poses good{{0, 1}, std::vector<float>(2 * 3 * 4, 0.5F), {}, {}, {}};
  EXPECT_EQ(fault(good, 4), "");
  EXPECT_EQ(fault(good, 5),
            "poses: positions_m has 24 values; 30 (2 poses x 3 x 5 vertices) are needed");
  Poses poses = good;
  poses.times = {1, 1};
  EXPECT_EQ(fault(poses, 4), "poses.times_s[1]: 1 s does not come after the pose before it, 1 s");
  poses.times = {0, std::nan("")};
  EXPECT_NE(fault(poses, 4).find("times_s[1]: nan s is not within 0 to 1e+06 s"),
            std::string::npos);
  poses = good;
  poses.positions[12 + 4 + 2] = std::nanf("");
  EXPECT_NE(fault(poses, 4).find("positions_m: vertex 2 of pose 1"), std::string::npos);
  poses.positions[12 + 4 + 2] = 200;
  EXPECT_NE(fault(poses, 4).find("vertex 2 moves 199.5 m in 1 s to pose 1, 199.5 m/s; colliders "
                                 "move at most 100 m/s"),
            std::string::npos)
      << fault(poses, 4);
}

TEST(Poses, WaitUntilADressingHasLetTheBodyGrowBack) {
  Scene scene = resting_on(leaping_ball());
  scene.dressing = Dressing{.close = 0.02, .settle = 0.02, .deflate = 0.01, .holds = {}};
  EXPECT_TRUE(find_problems(scene).empty());
  scene.dressing->settle = 0.1;
  const auto problems = find_problems(scene);
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_EQ(problems[0].field, "colliders[0].mesh.data.poses.times_s[0]");
  scene.dressing->deflate = 0;
  EXPECT_TRUE(find_problems(scene).empty());
}

}  // namespace
}  // namespace weft::testing

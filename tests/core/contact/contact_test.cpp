#include "core/contact/contact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "core/lattice/contact.h"
#include "core/lattice/law.h"
#include "tests/support/core/bodies.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

Collider body(decltype(Collider::shape) shape, double friction = 0.3) {
  return {"body", shape, friction, {}};
}

Quaterniond tilted() { return Quaterniond(Eigen::AngleAxisd(0.6, Vector3d(1, 2, 3).normalized())); }

std::vector<Collider> every_shape() {
  return {body(Plane{Vector3d(0, -0.2, 0), Vector3d(0.1, 2, 0)}),
          body(Sphere{Vector3d(0.2, -0.25, 0.2), 0.2}),
          body(Box{Vector3d(0.2, -0.2, 0.2), Vector3d(0.15, 0.1, 0.12), tilted()}),
          body(Capsule{Vector3d(0.05, -0.1, 0.1), Vector3d(0.35, -0.2, 0.3), 0.06})};
}

TEST(Contact, DistancesAreThoseOfTheGeometry) {
  EXPECT_DOUBLE_EQ(distance(Plane{Vector3d(0, 1, 0), Vector3d(0, 2, 0)}, {5, 4, 0}).value, 3);
  EXPECT_DOUBLE_EQ(distance(Sphere{Vector3d(1, 0, 0), 2}, {1, 5, 0}).value, 3);
  const Box box{Vector3d::Zero(), Vector3d(1, 2, 3)};
  EXPECT_DOUBLE_EQ(distance(box, {4, 6, 3}).value, 5);           // from an edge
  EXPECT_DOUBLE_EQ(distance(box, {0.5, 1.75, 0}).value, -0.25);  // inside
  EXPECT_EQ(distance(box, {0.5, -1.75, 0}).normal, -Vector3d::UnitY());
  const Capsule capsule{Vector3d::Zero(), Vector3d(2, 0, 0), 0.5};
  EXPECT_DOUBLE_EQ(distance(capsule, {1, 2, 0}).value, 1.5);
  EXPECT_DOUBLE_EQ(distance(capsule, {5, 4, 0}).value, 4.5);
}

// The normal is the gradient of the distance, inside and outside, on turned bodies too.
TEST(Contact, NormalsAreGradientsOfTheDistance) {
  const Matrix3Xd points = 0.5 * noise(200);
  for (const Collider& collider : every_shape()) {
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const Distance here = distance(collider, points.col(i), 0);
      const double step = 1e-6;
      const double ahead = distance(collider, points.col(i) + step * here.normal, 0).value;
      EXPECT_NEAR((ahead - here.value) / step, 1, 1e-4) << collider.shape.index();
      EXPECT_NEAR(here.normal.norm(), 1, 1e-12);
    }
  }
}

Scene drop_on(const std::vector<Collider>& colliders) {
  Scene scene = floating(flat_sheet(13, 13));
  scene.environment.gravity = {0, -9.8, 0};
  scene.colliders = colliders;
  scene.solver.frame_step = 0.02;
  return scene;
}

TEST(Contact, NoFreeParticleEndsAStepInsideACollider) {
  for (const Collider& collider : every_shape()) {
    Scene scene = drop_on({collider});
    scene.solver.frame_step = Simulation(scene).plan().step.substep;
    Simulation simulation(scene);
    int touching = 0;
    for (int step = 0; step < 2000; ++step) {
      ASSERT_TRUE(simulation.advance_frame());
      const Matrix3Xd x = positions(simulation);
      for (Eigen::Index i = 0; i < x.cols(); ++i) {
        const double value = distance(collider, x.col(i), simulation.time()).value;
        ASSERT_GE(value, 0) << "shape " << collider.shape.index() << " step " << step;
        if (value < 0.1 / 30 * 1.001) ++touching;
      }
    }
    EXPECT_GT(touching, 0) << "shape " << collider.shape.index();
  }
}

// Boards, balls and capsules from 1 mm, up to 100 m/s, at steps of up to 10 ms.
TEST(Contact, NoBodyAndNoParticleCrossesTheOtherHoweverFastAndThin) {
  std::mt19937 random(23);
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto power = [&](double low, double high) {
    return low * std::pow(high / low, uniform(random));
  };
  const auto direction = [&] {
    return Vector3d(uniform(random) - 0.5, uniform(random) - 0.5, uniform(random) - 0.5)
        .normalized();
  };
  const double skin = 1e-3;
  for (int i = 0; i < 20'000; ++i) {
    SCOPED_TRACE(i);
    const Vector3d way = direction(), side = way.cross(direction()).normalized();
    const double half = power(5e-4, 0.1), dt = power(1e-6, 1e-2);
    Collider collider = body(Sphere{Vector3d::Zero(), half}, uniform(random));
    if (i % 3 == 1) collider.shape = Capsule{-0.3 * side, 0.3 * side, half};
    if (i % 3 == 2) {
      const Quaterniond turn = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), way);
      collider.shape = Box{Vector3d::Zero(), Vector3d(2, 2, half), turn};
    }
    // the particle comes along `way` as the collider sees it, and meets its middle
    const double speed = power(0.1, 100), own = uniform(random) * speed;
    collider.path = {{0, Vector3d::Zero()}, {dt, -(speed - own) * dt * way}};
    const double start = -(half + skin) - uniform(random) * speed * dt;
    Vector3d d = own * dt * way, x = start * way + d;
    const Contacts contacts(std::span(&collider, 1), {}, 0.3, skin, dt, dt);
    const Vector3d before = x;
    const bool touched = contacts.resolve(x, d);
    const Vector3d seen = x - collider.path[1].offset;
    EXPECT_LT(seen.dot(way), 0);
    EXPECT_GT(distance(collider, x, dt).value, skin - 1e-9);
    EXPECT_TRUE(touched || x == before);
    EXPECT_LE((d - (collider.path[1].offset)).norm(), speed * dt * (1 + 1e-9));
  }
}

TEST(Contact, WhereCollidersOverlapAParticleEntersByAtMostTheSkin) {
  const std::vector<Collider> colliders = every_shape();
  Simulation simulation(drop_on(colliders));
  for (int frame = 0; frame < 40; ++frame) {
    ASSERT_TRUE(simulation.advance_frame());
    const Matrix3Xd x = positions(simulation);
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      for (const Collider& collider : colliders)
        ASSERT_GE(distance(collider, x.col(i), simulation.time()).value, -0.1 / 30);
  }
}

// One push may lead into a body that was looked at before: the order of the list must not matter.
TEST(Contact, AFastParticleInAWedgeEndsOutsideBothBodiesInEitherOrder) {
  const Collider floor = body(Plane{}, 0), ball = body(Sphere{Vector3d(0, 0.1, 0), 0.3}, 0);
  const double skin = 1e-3;
  for (const auto& colliders : {std::vector{floor, ball}, std::vector{ball, floor}}) {
    Vector3d x(0.28, 0.01, 0), d(-0.03, -0.02, 0);
    EXPECT_TRUE(Contacts(colliders, {}, 0, skin, 1, 1e-3).resolve(x, d));
    for (const Collider& collider : colliders)
      EXPECT_GE(distance(collider, x, 1).value, 0) << collider.shape.index();
  }
}

// A lattice of which every 7th particle is held, in storage of its own.
template <class T>
struct Rows {
  using State = SweepState<T>;
  static constexpr int kRows = 6, kColumns = 37;
  static constexpr bool kCompensated = sizeof(T) == sizeof(float);

  Rows() {
    const Matrix3Xd points = 0.2 * noise(kRows * kColumns),
                    steps = 0.02 * noise(kRows * kColumns, 2);
    for (int i = 0; i < kRows * kColumns; ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        at(State::kX + axis, i) = static_cast<T>(points(axis, i));
        at(State::kD + axis, i) = static_cast<T>(steps(axis, i));
        at(State::kW + axis, i) = static_cast<T>(2 * steps(axis, i));
      }
      at(State::kStep2, i) = i % 7 == 0 ? T(0) : T(1e-5);
    }
  }
  T& at(int plane, int i) { return state.place(i / kColumns, i % kColumns)[plane]; }
  Vector3d exact(int plane, int error, int i) {
    Vector3d v;
    for (int axis = 0; axis < 3; ++axis) {
      v[axis] = at(plane + axis, i);
      if (kCompensated) v[axis] -= at(error + axis, i);
    }
    return v;
  }
  Vector3d x(int i) { return origin + exact(State::kX, State::kXError, i); }
  Vector3d d(int i) { return exact(State::kD, State::kDError, i); }

  const Vector3d origin{0.2, -0.2, 0.2};
  State state{make_sweep_law<T>(flat_sheet(kRows, kColumns)).layout, kCompensated};
};

// How much closer than its distance says a particle may be by what lies between the values of a
// grid.
double steepest(const Collider& collider) {
  return std::holds_alternative<SharedBody>(collider.shape) ? std::sqrt(3.0) : 1;
}

// Single precision keeps what it rounds off, to 2^-48 of the values.
template <class T>
void expect_rows_like_particles(const std::vector<Collider>& colliders) {
  const double tolerance = sizeof(T) == sizeof(float) ? 0x1p-46 : 0x1p-48;
  MovingBodies bodies(colliders);
  bodies.place(colliders, 0.7, 0.1);
  const Contacts contacts(colliders, bodies, 0.4, 1e-3, 0.7, 0.1);
  Rows<T> rows, before;
  constexpr std::size_t kGroups = LatticeLayout<T>::kLanes / KnownCells::kParticles;
  std::vector<KnownCells> known(static_cast<std::size_t>(rows.kRows * rows.state.vectors()) *
                                kGroups);
  int touched = 0, i = 0;
  for (int row = 0; row < rows.kRows; ++row) {
    const Resolved resolved =
        resolve_row(contacts, rows.origin, rows.kCompensated, row, known, rows.state);
    double nearest = std::numeric_limits<double>::infinity(), moved = 0, changed = 0;
    for (int c = 0; c < rows.kColumns; ++c, ++i) {
      Vector3d x = before.x(i), d = before.d(i);
      if (i % 7 != 0) {
        for (std::size_t k = 0; k < colliders.size(); ++k)
          nearest = std::min(
              nearest, (distance(colliders[k], x, 0.7, bodies.of(k)).value - contacts.skin()) /
                           steepest(colliders[k]));
        touched += contacts.resolve(x, d) ? 1 : 0;
      }
      moved = std::max(moved, (x - before.x(i)).norm());
      changed = std::max(changed, (d - before.d(i)).norm());
      EXPECT_LE((rows.x(i) - x).norm(), tolerance) << i;
      EXPECT_LE((rows.d(i) - d).norm(), tolerance) << i;
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(rows.at(rows.state.kW + axis, i),
                    before.at(rows.state.kW + axis, i) + 3 * (d - before.d(i))[axis],
                    4 * std::numeric_limits<T>::epsilon());
    }
    EXPECT_NEAR(resolved.gap, nearest, 1e-14) << row;
    EXPECT_NEAR(resolved.moved, moved, 2 * tolerance) << row;
    EXPECT_NEAR(resolved.changed, changed, 2 * tolerance) << row;
  }
  EXPECT_GT(touched, 10);
}

// A sheet that floats, in the way of a board that is larger than it.
TEST(Contact, ABoardOfAnyThicknessAndSpeedPushesASheetAlong) {
  for (const double thickness : {1e-3, 0.02}) {
    for (const double speed : {5.0, 30.0, 100.0}) {
      for (const Precision precision : {Precision::kSingle, Precision::kDouble}) {
        for (const bool plain : {false, true}) {
          SCOPED_TRACE(::testing::Message() << thickness << " m, " << speed << " m/s, " << plain);
          Scene scene = floating(flat_sheet(13, 13));
          scene.colliders = {body(Box{Vector3d(0, -0.1, 0), Vector3d(2, thickness / 2, 2)})};
          scene.colliders[0].path = {{0, Vector3d::Zero()}, {0.5 / speed, Vector3d(0, 0.5, 0)}};
          scene.solver.precision = precision;
          scene.solver.plain = plain;
          scene.solver.frame_step = 0.25 / speed;
          Simulation simulation(scene);
          for (int frame = 0; frame < 3; ++frame) {
            ASSERT_TRUE(simulation.advance_frame());
            const double front =
                -0.1 + offset_at(scene.colliders[0].path, simulation.time()).y() + thickness / 2;
            EXPECT_GT(positions(simulation).row(1).minCoeff(), front);
          }
        }
      }
    }
  }
}

TEST(Contact, OfARowInVectorsIsThatOfItsParticles) {
  std::vector<Collider> all = every_shape();
  all.push_back(solid(box_mesh(Vector3d(0.15, 0.1, 0.12), tilted())));
  all.back().path = {{0, Vector3d(0.2, -0.2, 0.2)}, {1, Vector3d(0.25, -0.2, 0.2)}};
  all[1].path = {{0, Vector3d::Zero()}, {1, Vector3d(0.05, 0, 0.1)}};
  all.push_back(posed(
      ball_mesh(0.15, 2), {0.1, 0.6, 0.8, 1.2},
      [](const Vector3d& vertex, double time) {
        return Vector3d((1 + 0.2 * time) * vertex +
                        Vector3d(0.2, 0.1 * time - 0.2, 0.2 + 0.3 * vertex.x() * time));
      },
      0.08));
  for (const Collider& collider : all) {
    expect_rows_like_particles<float>({collider});
    expect_rows_like_particles<double>({collider});
  }
  expect_rows_like_particles<float>(all);
  expect_rows_like_particles<double>(all);
}

double slide_on_incline(double angle, double friction, double seconds) {
  const Quaterniond turn(Eigen::AngleAxisd(-angle, Vector3d::UnitZ()));
  return slide_on(body(Plane{Vector3d::Zero(), turn * Vector3d::UnitY()}, friction), turn,
                  Vector3d(0, 1e-3, 0), seconds);
}

TEST(Contact, ABlockOnAnInclineSticksBelowTheFrictionAngleAndSlidesAboveItAsCoulombSays) {
  const double angle = 0.5, seconds = 0.5;
  EXPECT_LT(slide_on_incline(angle, std::tan(angle) * 1.05, seconds), 1e-6);
  const double friction = 0.2;
  const double a = 9.8 * (std::sin(angle) - friction * std::cos(angle));
  EXPECT_NEAR(slide_on_incline(angle, friction, seconds) / (a * seconds * seconds / 2), 1, 2e-3);
  const double free = 9.8 * std::sin(angle);
  EXPECT_NEAR(slide_on_incline(angle, 0, seconds) / (free * seconds * seconds / 2), 1, 2e-3);
}

TEST(Contact, AMovingColliderCarriesWhatLiesOnItByFriction) {
  SheetDefinition sheet = flat_sheet(2, 2, 0.05);
  sheet.textile.friction = 1;
  sheet.origin = {0, 0.005, 0};
  Scene scene = floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  Collider belt = body(Plane{}, 1);
  belt.path = {{0, Vector3d::Zero()}, {1, Vector3d(0.5, 0.2, 0)}};
  scene.colliders = {belt};
  Simulation simulation(scene);
  const Matrix3Xd start = positions(simulation);
  for (int frame = 0; frame < 100; ++frame) ASSERT_TRUE(simulation.advance_frame());
  const Matrix3Xd moved = positions(simulation) - start;
  EXPECT_NEAR(moved(0, 0), 0.5, 0.03);  // it slips until it is as fast as the belt
  EXPECT_NEAR(moved(1, 0), 0.2, 1e-6);
}

TEST(Contact, ASheetThatStartsInsideComesOutWithoutBeingThrown) {
  SheetDefinition sheet = flat_sheet(3, 3, 0.05);
  sheet.origin = {0, -0.02, 0};
  Scene scene = floating(sheet);
  scene.colliders = {body(Plane{})};
  Simulation simulation(scene);
  ASSERT_TRUE(simulation.advance_frame());
  EXPECT_NEAR(positions(simulation)(1, 4), 0.005, 1e-12);  // on the skin
  EXPECT_LT(velocities(simulation).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Contact, AnImpactTakesAwayTheApproachAndLeavesTheSliding) {
  SheetDefinition sheet = flat_sheet(2, 2, 0.05);
  sheet.textile = {RawTextile{.particle_mass = 1e-3}, 0, 0};
  sheet.origin = {0, 0.1, 0};
  sheet.start_velocities = values(Vector3d(0.7, -2, 0.1).replicate(1, 4));
  Scene scene = floating(sheet);
  scene.colliders = {body(Plane{}, 0)};
  scene.solver.substep = 1e-3;
  Simulation simulation(scene);
  for (int frame = 0; frame < 10; ++frame) ASSERT_TRUE(simulation.advance_frame());
  EXPECT_LT((velocities(simulation).col(0) - Vector3d(0.7, 0, 0.1)).norm(), 1e-9);
}

}  // namespace
}  // namespace weft::testing

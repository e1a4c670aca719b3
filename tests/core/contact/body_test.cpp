#include "core/contact/body.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "core/contact/contact.h"
#include "tests/support/core/bodies.h"
#include "tests/support/core/last_first.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

std::vector<BodyMesh> meshes() {
  const Quaterniond turn(Eigen::AngleAxisd(0.6, Vector3d(1, 2, 3).normalized()));
  return {ball_mesh(0.1, 1), box_mesh({0.15, 0.1, 0.12}, turn),
          together(box_mesh({0.1, 0.05, 0.1}), box_mesh({0.05, 0.1, 0.04}, turn), {0.02, 0.1, 0})};
}

// Flat across its lower half, and turned over below.
BodyMesh wrung_ball() {
  BodyMesh mesh = ball_mesh(0.1, 3);
  for (Vector3d& v : mesh.vertices) v.x() *= (v.y() + 0.02) / 0.1;
  return mesh;
}

// Trilinear values round an edge off, by a third of a cell at most.
TEST(Bodies, HaveDistancesWithinAThirdOfACellOfTheExactOnes) {
  for (const BodyMesh& mesh : meshes()) {
    const Collider body = solid(mesh);
    const DistanceGrid& grid = std::get<SharedBody>(body.shape)->grid;
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(-0.2, 0.25);
    double worst = 0, squares = 0;
    int near = 0, inside = 0;
    for (int i = 0; i < 320; ++i) {
      Vector3d point(uniform(random), uniform(random), uniform(random));
      if (i % 4 != 0) {  // near the surface
        const auto& triangle = mesh.triangles[random() % mesh.triangles.size()];
        const double share = std::abs(uniform(random));
        point = point * 0.04 + share * corner_of(mesh, triangle, 0) +
                (1 - share) * (corner_of(mesh, triangle, 1) + corner_of(mesh, triangle, 2)) / 2;
      }
      const double value = distance(body, point, 0).value, exact = signed_distance(mesh, point);
      const bool deep = exact < -grid.cell;  // where blocks stand for cells
      EXPECT_LE(value, exact + (deep ? DistanceGrid::kBlock / 2.0 : 1 / 3.0) * grid.cell) << i;
      EXPECT_EQ(value < 0, exact < 0) << i << ": " << exact;
      inside += exact < 0 ? 1 : 0;
      if (exact > grid.reach || deep) continue;
      worst = std::max(worst, std::abs(value - exact));
      squares += (value - exact) * (value - exact);
      ++near;
    }
    EXPECT_GT(inside, 30);
    EXPECT_GT(near, 50);
    EXPECT_LT(worst, grid.cell / 3);
    EXPECT_LT(std::sqrt(squares / near), grid.cell / 10);
  }
}

TEST(Bodies, OfAPersonsSizeHaveCellsOfHalfACentimetreInAFewMegabytes) {
  BodyMesh mesh = ball_mesh(0.3, 4);
  for (Vector3d& v : mesh.vertices) v = v.cwiseProduct(Vector3d(1, 2.8, 0.5));
  const MadeBody made = make_body(mesh, {.reach = 2e-3}, "mesh");
  EXPECT_LT(made.body->grid.cell, 5e-3);
  EXPECT_LT(made.body->grid.values.size() * sizeof(float), 8e6);
  EXPECT_NEAR(made.body->thickness, 0.3 * std::sqrt(0.5), 0.15);
}

TEST(Bodies, AreTheSameHoweverManyThreadsMakeThem) {
  std::vector<BodyMesh> all = meshes();
  all.push_back(wrung_ball());
  for (const BodyMesh& mesh : all) {
    const BodySettings settings{.cell = 2e-3, .reach = 2e-3};
    LastFirst three(3);
    const MadeBody alone = make_body(mesh, settings, "mesh");
    const MadeBody made = make_body(mesh, settings, "mesh", three);
    ASSERT_EQ(made.body == nullptr, alone.body == nullptr);
    if (!made.body) {
      EXPECT_EQ(made.problems[0].message, alone.problems[0].message);
      continue;
    }
    EXPECT_EQ(made.body->grid.begin, alone.body->grid.begin);
    EXPECT_EQ(made.body->grid.values, alone.body->grid.values);
    EXPECT_EQ(made.body->thickness, alone.body->thickness);
    EXPECT_EQ(made.body->thinnest, alone.body->thinnest);
    EXPECT_EQ(made.body->notes, alone.body->notes);
  }
}

std::string fault(const BodyMesh& mesh) {
  const MadeBody made = make_body(mesh, {.reach = 1e-3}, "colliders[0].mesh");
  EXPECT_EQ(made.body == nullptr, !made.problems.empty());
  return made.problems.empty() ? "" : made.problems[0].field + ": " + made.problems[0].message;
}

TEST(Bodies, ThatEncloseNothingAreRefusedWithThePlace) {
  BodyMesh open = ball_mesh(0.1, 1);
  open.triangles.erase(open.triangles.begin() + 7);
  EXPECT_NE(fault(open).find("colliders[0].mesh.triangles: triangle"), std::string::npos);
  EXPECT_NE(fault(open).find("open"), std::string::npos);

  BodyMesh finned = box_mesh({0.1, 0.1, 0.1});
  finned.vertices.emplace_back(0.3, 0.3, 0.3);
  finned.triangles.push_back({6, 7, 8});
  EXPECT_NE(fault(finned).find("edge between vertices 6 and 7 has 3 triangles"), std::string::npos);

  BodyMesh wrong = box_mesh({0.1, 0.1, 0.1});
  wrong.triangles[5][1] = 8;
  EXPECT_NE(fault(wrong).find("triangle 5 has a corner of index 8; there are 8"),
            std::string::npos);
  for (const Eigen::Index axis : {0, 1, 2}) {
    wrong = box_mesh({0.1, 0.1, 0.1});
    wrong.vertices[3][axis] = std::nan("");
    EXPECT_NE(fault(wrong).find("vertex 3"), std::string::npos) << axis;
  }
  EXPECT_NE(fault(box_mesh({0.1, 0, 0.1})), "");
}

TEST(Bodies, ThatAreInsideOutInAPartAreRefused) {
  const std::string found = fault(wrung_ball());
  EXPECT_NE(found.find("inside out"), std::string::npos) << found;
}

TEST(Bodies, AreMendedWhereTheirInsidesAreClear) {
  const BodyMesh good = ball_mesh(0.1, 2);
  BodyMesh inverted = good, one = good, split;
  for (auto& triangle : inverted.triangles) std::swap(triangle[0], triangle[1]);
  std::swap(one.triangles[17][0], one.triangles[17][2]);
  for (const auto& triangle : good.triangles) {
    const int first = static_cast<int>(split.vertices.size());
    for (std::size_t k = 0; k < 3; ++k) split.vertices.push_back(corner_of(good, triangle, k));
    split.triangles.push_back({first, first + 1, first + 2});
  }
  const MadeBody wanted = make_body(good, {.reach = 1e-3}, "mesh");
  EXPECT_TRUE(wanted.body->notes.empty());
  for (const BodyMesh& mesh : {inverted, one, split}) {
    const MadeBody made = make_body(mesh, {.reach = 1e-3}, "mesh");
    ASSERT_TRUE(made.body);
    EXPECT_EQ(made.body->notes.size(), 1u);
    for (const Vector3d& point :
         {Vector3d(0, 0, 0.099), Vector3d(0.05, 0.09, 0), Vector3d(0, 0, 0)})
      EXPECT_NEAR(distance(made.body, point).value, distance(wanted.body, point).value, 1e-6);
  }
  const MadeBody two = make_body(together(good, good, {0.11, 0, 0}), {.reach = 1e-3}, "mesh");
  ASSERT_EQ(two.body->notes.size(), 1u);
  EXPECT_NE(two.body->notes[0].find("cuts itself"), std::string::npos);
  EXPECT_LT(distance(two.body, {0.055, 0, 0}).value, 0);
}

Scene falling_on(std::vector<Collider> colliders, int columns = 31, double spacing = 0.01) {
  SheetDefinition sheet = flat_sheet(columns, columns, spacing);
  const double half = (columns - 1) * spacing / 2;
  sheet.origin = {-half, 0, -half};
  sheet.textile.damping = 0.02;
  Scene scene = floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  scene.colliders = std::move(colliders);
  return scene;
}

Collider moved(Collider collider, const Vector3d& by) {
  collider.path = {{0, by}};
  return collider;
}

TEST(Bodies, OfABallsTrianglesCarryASheetWithinAFifthOfAMillimetreOfTheBall) {
  const double radius = 0.15, skin = 1e-3;
  const BodyMesh mesh = ball_mesh(radius, 4);
  EXPECT_EQ(mesh.triangles.size(), 5120u);
  Simulation simulation(falling_on({moved(solid(mesh, 1), {0, -radius - 2e-3, 0})}));
  for (int frame = 0; frame < 60; ++frame) ASSERT_TRUE(simulation.advance_frame());
  const Matrix3Xd x = positions(simulation);
  const Vector3d middle(0, -radius - 2e-3, 0);
  int resting = 0;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const double height = (x.col(i) - middle).norm() - radius - skin;
    EXPECT_GT(height, -2e-4) << i;
    if (distance(simulation.scene().colliders[0], x.col(i), 1).value > skin + 1e-6) continue;
    EXPECT_LT(height, 2e-4) << i;
    ++resting;
  }
  EXPECT_GT(resting, 50);
}

double slide_down(double angle, double friction, double seconds) {
  const Quaterniond turn(Eigen::AngleAxisd(-angle, Vector3d::UnitZ()));
  return slide_on(solid(box_mesh({0.5, 0.1, 0.1}, turn), friction), turn,
                  Vector3d(0.013, 0.101, 0.007), seconds);
}

TEST(Bodies, OfTrianglesLetAPatchSlideFromHalfADegreeAboveTheFrictionAngle) {
  constexpr double kHalfDegree = 0.5 * std::numbers::pi / 180;
  for (const double angle : {0.2, 0.5}) {
    EXPECT_LT(slide_down(angle, std::tan(angle + kHalfDegree), 0.4), 1e-5);
    const double friction = std::tan(angle - kHalfDegree);
    const double a = 9.8 * (std::sin(angle) - friction * std::cos(angle));
    EXPECT_NEAR(slide_down(angle, friction, 0.4) / (a * 0.4 * 0.4 / 2), 1, 0.03);
  }
}

TEST(Bodies, OfABoxAsTrianglesHoldASheetAsTheBoxDoes) {
  const Vector3d half(0.08, 0.05, 0.1), below(0, -0.053, 0);
  Simulation one(falling_on({{"box", Box{below, half, Quaterniond::Identity()}, 0.3, {}}})),
      other(falling_on({moved(solid(box_mesh(half)), below)}));
  for (int frame = 0; frame < 40; ++frame) {
    ASSERT_TRUE(one.advance_frame());
    ASSERT_TRUE(other.advance_frame());
  }
  const Matrix3Xd x = positions(one), y = positions(other);
  const double skin = 1e-3,
               cell = std::get<SharedBody>(other.scene().colliders[0].shape)->grid.cell;
  double squares = 0;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    EXPECT_GE(distance(one.scene().colliders[0], y.col(i), 1).value, skin - cell / 3) << i;
    EXPECT_LT((x.col(i) - y.col(i)).norm(), 5e-3) << i;
    squares += (x.col(i) - y.col(i)).squaredNorm();
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(x.cols())), 1e-3);
}

TEST(Bodies, ThatMoveTakeAlongWhatLiesOnThem) {
  Scene scene = falling_on({solid(box_mesh({0.25, 0.05, 0.25}), 1)}, 11);
  scene.sheets[0].textile.friction = 1;
  scene.colliders[0].path = {{0, {0, -0.052, 0}}, {1, {0.2, 0.048, 0}}};
  Simulation simulation(scene);
  const Matrix3Xd start = positions(simulation);
  for (int frame = 0; frame < 100; ++frame) ASSERT_TRUE(simulation.advance_frame());
  const Matrix3Xd way = positions(simulation) - start;
  for (Eigen::Index i = 0; i < way.cols(); ++i) {
    EXPECT_NEAR(way(0, i), 0.2, 0.01);
    EXPECT_NEAR(way(1, i), 0.099, 1e-4);
  }
}

// Where the plain path looks at every particle in every step, the fast one looks when it must.
TEST(Bodies, ThatAreFarAreSkippedWithoutMissingAContact) {
  Collider ball = moved(solid(ball_mesh(0.1, 2)), {0.05, -0.13, 0.02});
  Collider box = solid(box_mesh({0.1, 0.02, 0.1}));
  box.name = "lift";
  box.path = {{0, {-0.1, -0.2, 0}}, {0.2, {-0.1, -0.1, 0}}};
  Scene scene = falling_on({ball, box}, 21);
  scene.solver.precision = Precision::kDouble;
  Simulation fast(scene);
  scene.solver.plain = true;
  Simulation plain(scene);
  for (int frame = 0; frame < 25; ++frame) {
    ASSERT_TRUE(fast.advance_frame());
    ASSERT_TRUE(plain.advance_frame());
    ASSERT_LE((positions(fast) - positions(plain)).cwiseAbs().maxCoeff(), 1e-9) << frame;
  }
}

// Deep inside, where the skin of a deflated body is, distances jump.
TEST(Bodies, ThatAreDeflatedAreSkippedWithoutMissingAContact) {
  const std::vector<Collider> bodies{solid(box_mesh({0.15, 0.1, 0.12}))};
  const Contacts contacts(bodies, MovingBodies(bodies), 0.3, 1e-3, 0, 1e-3, 0.01);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> place(-0.16, 0.16), part(-1, 1);
  const auto anywhere = [&](auto& from) {
    return Vector3d(from(random), from(random), from(random));
  };
  int far = 0;
  for (int i = 0; i < 1'000'000; ++i) {
    const Vector3d x = anywhere(place);
    const double gap = contacts.gap(x);
    if (!(gap > 0)) continue;
    EXPECT_GE(contacts.gap(x + gap * anywhere(part).normalized()), 0) << x;
    ++far;
  }
  EXPECT_GT(far, 10'000);
}

TEST(Bodies, GiveTheSameBitsAfterASnapshot) {
  const Scene scene = falling_on({moved(solid(ball_mesh(0.1, 2)), {0, -0.11, 0})});
  Simulation one(scene), other(scene);
  for (int frame = 0; frame < 10; ++frame) ASSERT_TRUE(one.advance_frame());
  ASSERT_TRUE(other.restore(one.snapshot()));
  for (int frame = 0; frame < 10; ++frame) {
    ASSERT_TRUE(one.advance_frame());
    ASSERT_TRUE(other.advance_frame());
  }
  EXPECT_EQ(positions(one), positions(other));
  EXPECT_EQ(velocities(one), velocities(other));
}

bool warns(const Simulation& simulation, const std::string& code) {
  EXPECT_THAT(warning_codes(), ::testing::Contains(code));
  const auto& warnings = simulation.plan().warnings;
  return std::any_of(warnings.begin(), warnings.end(),
                     [&](const Warning& each) { return each.code == code; });
}

TEST(Bodies, LetASheetThatStartsInsideOutSlowlyAndWithoutThrowingIt) {
  Simulation simulation(falling_on({moved(solid(ball_mesh(0.15, 3)), {0, -0.1, 0})}, 21));
  EXPECT_TRUE(warns(simulation, "STARTS_INSIDE"));
  Matrix3Xd before = positions(simulation);
  for (int frame = 0; frame < 100; ++frame) {
    ASSERT_TRUE(simulation.advance_frame());
    const Matrix3Xd x = positions(simulation);
    EXPECT_LT((x - before).colwise().norm().maxCoeff(), 0.02) << frame;
    before = x;
  }
  EXPECT_TRUE(simulation.repairs().empty());
  const Collider& ball = simulation.scene().colliders[0];
  for (Eigen::Index i = 0; i < before.cols(); ++i)
    EXPECT_GT(distance(ball, before.col(i), 1).value, 0) << i;
  EXPECT_FALSE(warns(Simulation(falling_on({moved(solid(ball_mesh(0.15, 3)), {0, -0.2, 0})})),
                     "STARTS_INSIDE"));
}

TEST(Bodies, ThinnerThanTwoCellsAreWarnedOf) {
  const Collider board = solid(box_mesh({0.2, 1e-3, 0.2}));
  EXPECT_NEAR(std::get<SharedBody>(board.shape)->thickness, 2e-3, 1e-9);
  EXPECT_TRUE(warns(Simulation(falling_on({moved(board, {0, -0.1, 0})})), "BODY_THIN"));
  EXPECT_FALSE(
      warns(Simulation(falling_on({moved(solid(ball_mesh(0.1, 2)), {0, -0.2, 0})})), "BODY_THIN"));
}

TEST(Bodies, ReachAsFarAsTheSkinsOfTheirScene) {
  Scene scene = falling_on({moved(solid(ball_mesh(0.1, 2)), {0, -0.2, 0})});
  scene.sheets[0].skin = 0.02;
  const auto problems = find_problems(scene);
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_EQ(problems[0].field, "colliders[0].mesh");
  scene.colliders[0].shape = SharedBody();
  EXPECT_EQ(find_problems(scene).size(), 1u);
}

}  // namespace
}  // namespace weft::testing

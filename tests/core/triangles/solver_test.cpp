#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>

#include "core/simulation.h"
#include "core/triangles/near_order.h"
#include "core/triangles/triangles.h"
#include "tests/support/core/last_first.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/triangle_meshes.h"

// The vector kernels are held to the plain solver, which evaluates one triangle after the other.
namespace weft::testing {
namespace {

constexpr int kSteps = 6;

MeasuredTextile wool() {
  return {.areal_density = 0.2,
          .tensile_warp = 900,
          .tensile_weft = 600,
          .shear = 30,
          .bend_rigidity_warp = 2e-4,
          .bend_rigidity_weft = 1e-4};
}

SheetDefinition sheet_of(TriangleMesh mesh) {
  SheetDefinition sheet;
  sheet.name = "cloth";
  sheet.shape = complete(std::move(mesh));
  sheet.textile = {wool(), 1e-3, 0.3};
  sheet.bending = Isometric{};
  return sheet;
}

// One particle amid so many triangles.
TriangleMesh fan(int triangles) {
  TriangleMesh mesh;
  mesh.flat.emplace_back(0, 0);
  for (int k = 0; k < triangles; ++k) {
    const double angle = 2 * std::numbers::pi * k / triangles;
    mesh.flat.emplace_back(0.1 * std::cos(angle), 0.1 * std::sin(angle));
    mesh.triangles.push_back({0, 1 + k, 1 + (k + 1) % triangles});
  }
  return mesh;
}

// Two squares that do not know of each other.
TriangleMesh two_pieces() {
  TriangleMesh mesh = triangle_mesh(square(Cut::kIrregular, 0.1, 0.02));
  const TriangleMesh other = triangle_mesh(square(Cut::kRight, 0.06, 0.02));
  const int first = static_cast<int>(mesh.flat.size());
  for (const Vector2d& point : other.flat) mesh.flat.push_back(point + Vector2d(0.5, 0));
  for (const auto& [a, b, c] : other.triangles)
    mesh.triangles.push_back({a + first, b + first, c + first});
  mesh.start.clear();
  return mesh;
}

// A rectangle whose left and right sides are sewn together: corners there differ in (u, v).
TriangleMesh tube() {
  const int around = 14, along = 6;
  const double h = 0.02, radius = around * h / (2 * std::numbers::pi);
  TriangleMesh mesh;
  for (int r = 0; r < along; ++r)
    for (int c = 0; c < around; ++c) {
      const double angle = 2 * std::numbers::pi * c / around;
      mesh.start.emplace_back(radius * std::cos(angle), r * h, radius * std::sin(angle));
    }
  for (int r = 0; r < along; ++r)
    for (int c = 0; c <= around; ++c) mesh.flat.emplace_back(c * h, r * h);
  for (int r = 0; r + 1 < along; ++r)
    for (int c = 0; c < around; ++c) {
      const int a = r * around + c, b = r * around + (c + 1) % around;
      const int flat = r * (around + 1) + c, above = around + 1;
      mesh.triangles.push_back({a, b, b + around});
      mesh.flat_triangles.push_back({flat, flat + 1, flat + 1 + above});
      mesh.triangles.push_back({a, b + around, a + around});
      mesh.flat_triangles.push_back({flat, flat + 1 + above, flat + above});
    }
  return mesh;
}

// Two panels side by side, the second with warp at 30 degrees.
TriangleMesh two_panels() {
  TriangleMesh mesh = triangle_mesh(square(Cut::kIrregular, 0.2, 0.02));
  const int half = static_cast<int>(mesh.triangles.size()) / 2;
  mesh.panels = {{"front", half, 0.0},
                 {"back", static_cast<int>(mesh.triangles.size()) - half, 0.5}};
  return mesh;
}

TriangleMesh single_triangle() {
  TriangleMesh mesh;
  mesh.flat = {{0, 0}, {0.03, 0}, {0.01, 0.02}};
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

struct Form {
  const char* name;
  TriangleMesh (*make)();
};

const Form kForms[] = {
    {"one triangle", single_triangle},
    {"a fan of 3", [] { return fan(3); }},
    {"a fan of 40", [] { return fan(40); }},
    {"right", [] { return triangle_mesh(square(Cut::kRight, 0.3, 0.02)); }},
    {"alternating", [] { return triangle_mesh(square(Cut::kAlternating, 0.14, 0.02)); }},
    {"equilateral", [] { return triangle_mesh(square(Cut::kEquilateral, 0.14, 0.02)); }},
    {"irregular", [] { return triangle_mesh(square(Cut::kIrregular, 0.3, 0.02)); }},
    {"Delaunay", [] { return triangle_mesh(scattered(19, 0.02)); }},
    {"two pieces", two_pieces},
    {"a tube", tube},
    {"two panels", two_panels},
};

MeasuredTextile& measured(SheetDefinition& sheet) {
  return std::get<MeasuredTextile>(sheet.textile.model);
}

struct Feature {
  const char* name;
  void (*set)(SheetDefinition&);
};

const Feature kFeatures[] = {
    {"EverythingOn", [](SheetDefinition&) {}},
    {"NoDamping", [](SheetDefinition& s) { s.textile.damping = 0; }},
    {"NoBending",
     [](SheetDefinition& s) {
       measured(s).bend_rigidity_warp = measured(s).bend_rigidity_weft = 0;
     }},
    {"NoBendingNoDamping",
     [](SheetDefinition& s) {
       s.textile.damping = measured(s).bend_rigidity_warp = measured(s).bend_rigidity_weft = 0;
     }},
    {"NoShear", [](SheetDefinition& s) { measured(s).shear = 0; }},
    {"BendingAlone",
     [](SheetDefinition& s) {
       measured(s).tensile_warp = measured(s).tensile_weft = measured(s).shear = 0;
     }},
    {"Drag", [](SheetDefinition& s) { measured(s).air_drag = 0.1; }},
    {"ShortenedAtNoCost",
     [](SheetDefinition& s) { s.bending = Isometric{.resist_compression = false}; }},
    {"Folds",
     [](SheetDefinition& s) {
       TriangleMesh mesh = triangles_in(s);
       std::map<std::pair<int, int>, int> seen;
       for (const auto& triangle : mesh.triangles)
         for (std::size_t k = 0; k < 3; ++k)
           ++seen[std::minmax(triangle[k], triangle[(k + 1) % 3])];
       double angle = -3;
       for (const auto& [edge, triangles] : seen)
         if (triangles == 2 && (edge.first + edge.second) % 3 == 0)
           mesh.folds.push_back(
               {{edge.first, edge.second}, angle = angle > 2.5 ? -3 : angle + 0.7});
       s.shape = std::make_shared<const TriangleMesh>(mesh);
     }},
    {"PanelsOfTheirOwnTextile",
     [](SheetDefinition& s) {
       MeasuredTextile stiff = wool();
       stiff.tensile_warp = 300;
       stiff.bend_rigidity_weft = 5e-5;
       stiff.areal_density = 0.3;
       stiff.air_drag = 0.2;
       s.panel_textiles = {
           {static_cast<int>(triangles_in(s).panels.size()) - 1, {stiff, 1e-3, 0.3}}};
     }},
};

// A crumpled sheet in motion, a corner held and another one led.
Scene crumpled(SheetDefinition sheet, const std::optional<Wind>& wind = {}) {
  const int n = sheet.particle_count();
  sheet.start_positions = values(start_positions(sheet) + 0.2 * sheet.spacing() * noise(n));
  sheet.start_velocities = values(0.5 * noise(n, 2));
  sheet.pins = {{{0}, {}}, {{n - 1}, {{0, Vector3d::Zero()}, {1, Vector3d(0.2, 0.1, -0.3)}}}};
  Scene scene = floating(sheet);
  scene.environment.gravity = {0.3, -9.8, 0.1};
  scene.environment.wind = wind;
  scene.solver.substep = 0.5 * Simulation(scene).plan().step.linear_bound;
  scene.solver.frame_step = *scene.solver.substep;
  return scene;
}

Simulation after(Scene scene, int frames) {
  Simulation simulation(std::move(scene));
  for (int k = 0; k < frames; ++k) EXPECT_TRUE(simulation.advance_frame());
  return simulation;
}

// Rounding puts eps |x| K into a force, K the sum of stiffnesses at a particle, |x| the sheet's
// extent; with K dt^2 / m below 1 / 2 an acceleration error of every step adds up to
// n (n + 1) / 2 of them.
void expect_like_plain(const SheetDefinition& sheet, const std::string& what,
                       const std::optional<Wind>& wind = {},
                       IntegratorKind integrator = IntegratorKind::kVerlet, int slow_every = 1) {
  Scene scene = crumpled(sheet, wind);
  scene.solver.integrator = integrator;
  if (slow_every > 1) {  // in steps so short that these forces are slow
    *scene.solver.substep /= 30;
    scene.solver.frame_step = kSteps * *scene.solver.substep;
    scene.solver.slow_forces_every = slow_every;
  }
  const int frames = slow_every > 1 ? 1 : kSteps;
  scene.solver.plain = true;
  const Simulation plain = after(scene, frames);
  EXPECT_EQ(plain.plan().step.slow_every, slow_every);
  scene.solver.plain = false;
  for (const Precision precision : {Precision::kDouble, Precision::kSingle}) {
    scene.solver.precision = precision;
    const Simulation fast = after(scene, frames);
    const bool single = precision == Precision::kSingle;
    const double epsilon =
        single ? std::numeric_limits<float>::epsilon() : std::numeric_limits<double>::epsilon();
    const double most = epsilon * 0.7 * 4 * kSteps * (kSteps + 1) / 2;
    EXPECT_LE((positions(fast) - positions(plain)).cwiseAbs().maxCoeff(), most)
        << what << (single ? ", single" : ", double");
    EXPECT_LE((velocities(fast) - velocities(plain)).cwiseAbs().maxCoeff() * *scene.solver.substep,
              4 * most)
        << what << (single ? ", single" : ", double");
  }
}

class TriangleKernels : public ::testing::TestWithParam<Feature> {};

TEST_P(TriangleKernels, FollowThePlainSolverOnEveryMesh) {
  for (const Form& form : kForms) {
    SheetDefinition sheet = sheet_of(form.make());
    GetParam().set(sheet);
    expect_like_plain(sheet, form.name);
  }
}

TEST_P(TriangleKernels, FollowThePlainSolverInWind) {
  Wind wind;
  wind.velocity = {3, 1, -5};
  wind.gust = 0.5;
  wind.gust_period = 1e-3;
  wind.tangential_drag = 0.05;
  for (const Form& form : kForms) {
    SheetDefinition sheet = sheet_of(form.make());
    GetParam().set(sheet);
    expect_like_plain(sheet, form.name, wind);
  }
}

TEST_P(TriangleKernels, FollowThePlainSolverWithVelocitiesOfHalfAStepAgo) {
  Wind wind;
  wind.velocity = {3, 1, -5};
  SheetDefinition sheet = sheet_of(two_panels());
  GetParam().set(sheet);
  expect_like_plain(sheet, "two panels", wind, IntegratorKind::kLaggedVerlet);
}

TEST_P(TriangleKernels, FollowThePlainSolverWhereSlowForcesActRarely) {
  Wind wind;
  wind.velocity = {3, 1, -5};
  wind.tangential_drag = 0.05;
  SheetDefinition sheet = sheet_of(two_panels());
  GetParam().set(sheet);
  expect_like_plain(sheet, "two panels", wind, IntegratorKind::kVerlet, 3);
}

INSTANTIATE_TEST_SUITE_P(Sheets, TriangleKernels, ::testing::ValuesIn(kFeatures),
                         [](const auto& feature) { return std::string(feature.param.name); });

// A cloth that falls on a ball beside it, with everything on.
Scene falling(TriangleMesh mesh, const Feature& feature = kFeatures[0]) {
  SheetDefinition sheet = sheet_of(std::move(mesh));
  feature.set(sheet);
  sheet.pins = {{{0}, {}}};
  Scene scene = floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  scene.environment.wind = Wind{};
  scene.environment.wind->velocity = {1, 0, 2};
  const Vector3d middle = start_positions(sheet).rowwise().mean();
  scene.colliders = {{"ball", Sphere{middle - Vector3d(0, 0.06, 0), 0.05}, 0.3, {}}};
  scene.solver.frame_step = 5e-3;
  return scene;
}

TEST(TriangleRepeatability, RunsHaveTheSameBitsOnEveryProcessorWithFma) {
  for (const Precision precision : {Precision::kSingle, Precision::kDouble}) {
    for (const Feature& feature : kFeatures) {
      std::optional<Matrix3Xd> x, v;
      for (const std::int64_t target : {HWY_AVX2, HWY_AVX3, HWY_NEON}) {
        if ((hwy::SupportedTargets() & target) == 0) continue;
        hwy::SetSupportedTargetsForTest(target);
        Scene scene = falling(triangle_mesh(scattered(17, 0.02)), feature);
        scene.solver.precision = precision;
        const Simulation simulation = after(std::move(scene), 6);
        hwy::SetSupportedTargetsForTest(0);
        if (!x) x = positions(simulation), v = velocities(simulation);
        EXPECT_EQ(positions(simulation), *x) << feature.name << " " << hwy::TargetName(target);
        EXPECT_EQ(velocities(simulation), *v) << feature.name << " " << hwy::TargetName(target);
      }
      if (!x) GTEST_SKIP() << "this processor has no FMA";
    }
  }
}

// Golden hashes: they guard that results repeat to the bit, not that they are right.
TEST(TriangleRepeatability, RunsHaveTheBitsOfEarlierVersions) {
  Scene scene = falling(two_panels());
  scene.solver.precision = Precision::kSingle;
  EXPECT_EQ(hash_of(positions(after(scene, 10))), 16831131825890168353u);
  scene.solver.precision = Precision::kDouble;
  EXPECT_EQ(hash_of(positions(after(scene, 10))), 13570613404720585774u);
}

TEST(TriangleRepeatability, RunsHaveTheSameBitsHoweverManyHandsShareThem) {
  const Scene scene = falling(triangle_mesh(scattered(104, 0.004)));
  Simulation alone(scene), by_two(scene), by_five(scene);
  EXPECT_EQ(alone.most_threads(), 5);
  LastFirst two(2), five(5);
  for (int frame = 0; frame < 12; ++frame) {
    ASSERT_TRUE(alone.advance_frame());
    ASSERT_TRUE(by_two.advance_frame(two));
    ASSERT_TRUE(by_five.advance_frame(five));
  }
  EXPECT_EQ(positions(by_two), positions(alone));
  EXPECT_EQ(positions(by_five), positions(alone));
  EXPECT_EQ(velocities(by_five), velocities(alone));
}

TEST(TriangleRepeatability, WhatWasLetGoOfWhileASheetRestedChangesNothing) {
  const Scene scene = falling(two_panels());
  Simulation kept(scene), packed(scene);
  for (int frame = 0; frame < 10; ++frame) {
    ASSERT_TRUE(kept.advance_frame());
    ASSERT_TRUE(packed.advance_frame());
    packed.release_memory();
  }
  EXPECT_EQ(positions(packed), positions(kept));
  EXPECT_EQ(velocities(packed), velocities(kept));
}

// Where the plain path looks at every particle in every step, the fast one looks when it must.
TEST(TriangleContacts, AreSkippedWithoutMissingOne) {
  Scene scene = falling(triangle_mesh(scattered(15, 0.02)));
  scene.sheets[0].pins.clear();
  scene.environment.wind.reset();
  scene.colliders.push_back({"lift",
                             Plane{Vector3d(0, -0.12, 0), Vector3d::UnitY()},
                             0.3,
                             {{0, Vector3d::Zero()}, {0.2, Vector3d(0, 0.04, 0)}}});
  scene.solver.precision = Precision::kDouble;
  Simulation fast(scene);
  scene.solver.plain = true;
  Simulation plain(scene);
  for (int frame = 0; frame < 50; ++frame) {
    ASSERT_TRUE(fast.advance_frame());
    ASSERT_TRUE(plain.advance_frame());
    const Matrix3Xd x = positions(fast);
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      for (const Collider& collider : scene.colliders)
        ASSERT_GE(distance(collider, x.col(i), fast.time()).value, 0) << frame;
    if (frame < 25) {
      ASSERT_LE((x - positions(plain)).cwiseAbs().maxCoeff(), 1e-9) << frame;
    }
  }
}

// At 100 m/s a step carries it through a ball of 4 mm.
TEST(TriangleContacts, AreMetInPartsWhereAStepCouldCrossABody) {
  SheetDefinition sheet = sheet_of(triangle_mesh(square(Cut::kIrregular, 0.06, 0.02)));
  const int n = sheet.particle_count();
  Matrix3Xd v = Matrix3Xd::Zero(3, n);
  v.row(1).setConstant(-100);
  sheet.start_velocities = values(v);
  sheet.skin = 1e-3;
  Scene scene = floating(sheet);
  scene.colliders = {
      {"plate", Box{Vector3d(0.03, -0.05, 0.03), Vector3d(1, 1e-3, 1), {1, 0, 0, 0}}, 0.3, {}}};
  scene.solver.frame_step = 1e-3;
  for (const Precision precision : {Precision::kSingle, Precision::kDouble}) {
    scene.solver.precision = precision;
    const Simulation simulation = after(scene, 2);
    EXPECT_GT(positions(simulation).row(1).minCoeff(), -0.05);
  }
}

TEST(TriangleSnapshots, GoOnWithTheSameBits) {
  for (const Precision precision : {Precision::kSingle, Precision::kDouble}) {
    Scene scene = falling(two_panels(), kFeatures[8]);
    scene.solver.precision = precision;
    Simulation one(scene);
    for (int frame = 0; frame < 8; ++frame) ASSERT_TRUE(one.advance_frame());
    Simulation other(scene);
    ASSERT_TRUE(other.restore(one.snapshot()));
    for (int frame = 0; frame < 8; ++frame) {
      ASSERT_TRUE(one.advance_frame());
      ASSERT_TRUE(other.advance_frame());
    }
    EXPECT_EQ(positions(one), positions(other));
    EXPECT_EQ(velocities(one), velocities(other));
  }
}

TEST(NearOrder, HasEveryParticleOnceAndNeighboursNear) {
  constexpr int kColumns = 60;
  std::vector<std::vector<int>> near(kColumns * kColumns + 1);  // the last one by itself
  const auto join = [&](int i, int j) {
    near[static_cast<std::size_t>(i)].push_back(j);
    near[static_cast<std::size_t>(j)].push_back(i);
  };
  std::vector<int> name(kColumns * kColumns);
  std::iota(name.begin(), name.end(), 0);
  std::shuffle(name.begin(), name.end(), std::mt19937(1));
  for (int i = 0; i < kColumns * kColumns; ++i) {
    if (i % kColumns > 0)
      join(name[static_cast<std::size_t>(i)], name[static_cast<std::size_t>(i - 1)]);
    if (i >= kColumns)
      join(name[static_cast<std::size_t>(i)], name[static_cast<std::size_t>(i - kColumns)]);
  }
  const std::vector<int> order = near_order(near);
  ASSERT_EQ(order.size(), near.size());
  std::vector<int> place(near.size(), -1);
  for (std::size_t k = 0; k < order.size(); ++k)
    place[static_cast<std::size_t>(order[k])] = static_cast<int>(k);
  EXPECT_EQ(std::count(place.begin(), place.end(), -1), 0);
  double apart = 0;
  int count = 0;
  for (std::size_t i = 0; i < near.size(); ++i)
    for (const int j : near[i]) {
      apart += std::abs(place[i] - place[static_cast<std::size_t>(j)]);
      ++count;
    }
  EXPECT_LT(apart / count, 4 * kColumns) << "in no order it is 20 times as much";
}

}  // namespace
}  // namespace weft::testing

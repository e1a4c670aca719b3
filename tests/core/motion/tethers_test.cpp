#include "core/motion/tethers.h"

#include <gmock/gmock.h>
#include <hwy/targets.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/triangles/geodesics.h"
#include "tests/support/core/last_first.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/triangle_meshes.h"

namespace weft::testing {
namespace {

using ::testing::Contains;
using ::testing::Not;

// Soft, 1 m x 1 m, level at the start.
SheetDefinition soft_sheet(int side, double stiffness) {
  SheetDefinition sheet = flat_sheet(side, side, 1.0 / (side - 1));
  const double mass = 0.2 / (side * side);
  sheet.textile = {
      RawTextile{
          .particle_mass = mass, .stretch = stiffness, .shear = stiffness, .air_drag = 2 * mass},
      2e-4, 0.3};
  sheet.bending = Isometric{};
  sheet.tether_stretch = 0;
  return sheet;
}
SheetDefinition soft_triangles(int side) {
  SheetDefinition sheet = soft_sheet(side, 0);
  sheet.shape = complete(triangle_mesh(cut_rectangle(Cut::kIrregular, 1, 1, 1.0 / (side - 1))));
  sheet.textile.model = MeasuredTextile{.areal_density = 0.2,
                                        .tensile_warp = 50,
                                        .tensile_weft = 50,
                                        .shear = 25,
                                        .bend_rigidity_warp = 1e-5,
                                        .bend_rigidity_weft = 1e-5};
  return sheet;
}

Scene hung_by(SheetDefinition sheet, const std::vector<Pin>& pins,
              Precision precision = Precision::kSingle) {
  sheet.pins = pins;
  Scene scene = floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  scene.solver.precision = precision;
  scene.solver.frame_step = 1.0 / 60;
  return scene;
}

// To and fro.
Path shaken() {
  Path path;
  for (int k = 0; k <= 10; ++k)
    path.push_back({0.1 * k, Vector3d(0.3 * (k % 2), 0.2 * (k % 3), -0.2 * (k % 2))});
  return path;
}

// The largest share by which a particle is farther from the held one than in the flat sheet.
double excess(const Simulation& simulation, int held) {
  const Matrix3Xd x = positions(simulation);
  const SheetShape& shape = simulation.scene().sheets[0].shape;
  double most = -1;
  for (int i = 0; i < x.cols(); ++i) {
    if (i == held) continue;
    const double flat = (local_position(shape, i) - local_position(shape, held)).norm();
    most = std::max(most, (x.col(i) - x.col(held)).norm() / flat - 1);
  }
  return most;
}

double largest_excess(const Scene& scene, int held, int frames) {
  Simulation simulation(scene);
  double most = -1;
  for (int frame = 0; frame < frames; ++frame) {
    EXPECT_TRUE(simulation.advance_frame());
    most = std::max(most, excess(simulation, held));
  }
  for (const Repair& repair : simulation.repairs()) ADD_FAILURE() << repair.reason;
  return most;
}

TEST(Tethers, NoParticleIsFartherThanTheClothBetweenIsLong) {
  for (const Path& path : {Path(), shaken()})
    for (const double stretch : {0.0, 0.02})
      for (const Precision precision : {Precision::kSingle, Precision::kDouble})
        for (const bool plain : {false, true}) {
          SheetDefinition sheet = soft_sheet(17, 50);
          sheet.tether_stretch = stretch;
          Scene scene = hung_by(sheet, {{{0}, path}}, precision);
          scene.solver.plain = plain;
          const bool exact = plain || precision == Precision::kDouble;
          const double excess = largest_excess(scene, 0, 60);
          EXPECT_LE(excess, stretch + (exact ? 1e-12 : 2e-6)) << path.size() << plain;
          EXPECT_GT(excess, stretch - 1e-4);
        }
}

// One after the other: what the last moves may be beyond the first.
TEST(Tethers, OfTwoAttachmentsAreBothKept) {
  const Scene scene = hung_by(soft_sheet(31, 50), {{{0, 30}, {}}});
  EXPECT_LT(largest_excess(scene, 30, 60), 1e-5);
  Simulation simulation(scene);
  for (int frame = 0; frame < 60; ++frame) {
    ASSERT_TRUE(simulation.advance_frame());
    const Matrix3Xd x = positions(simulation);
    for (int i = 1; i < 961; ++i)
      ASSERT_LT((x.col(i) - x.col(0)).norm(),
                local_position(scene.sheets[0].shape, i).norm() + 1.5e-3)
          << i;
  }
}

TEST(Tethers, WithoutThemSoftClothStretchesByMuch) {
  SheetDefinition sheet = soft_sheet(17, 50);
  sheet.tether_stretch.reset();
  EXPECT_GT(largest_excess(hung_by(sheet, {{{0}, {}}}), 0, 60), 0.1);
}

TEST(Tethers, OfTrianglesReachAsFarAsTheClothDoes) {
  EXPECT_LE(largest_excess(hung_by(soft_triangles(17), {{{0}, {}}}), 0, 60), 0.01);
}

// A particle that nothing but a tether holds is a pendulum: phi'' = -g / l sin(phi), here by steps
// of Runge-Kutta.
double pendulum(double length, double seconds) {
  const auto acceleration = [&](double phi) { return -9.8 / length * std::sin(phi); };
  double phi = std::numbers::pi / 2, omega = 0;
  constexpr int kParts = 10'000;
  const double dt = seconds / kParts;
  for (int step = 0; step < kParts; ++step) {
    const double v1 = omega, a1 = acceleration(phi);
    const double v2 = omega + dt / 2 * a1, a2 = acceleration(phi + dt / 2 * v1);
    const double v3 = omega + dt / 2 * a2, a3 = acceleration(phi + dt / 2 * v2);
    const double v4 = omega + dt * a3, a4 = acceleration(phi + dt * v3);
    phi += dt / 6 * (v1 + 2 * v2 + 2 * v3 + v4);
    omega += dt / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  return phi;
}

TEST(Tethers, AParticleOnOneSwingsAsAPendulum) {
  SheetDefinition sheet = soft_sheet(2, 0);
  sheet.textile.damping = 0;
  std::get<RawTextile>(sheet.textile.model).air_drag = 0;
  std::array<double, 2> error{};
  for (std::size_t finer = 0; finer < 2; ++finer) {
    Scene scene = hung_by(sheet, {{{0}, {}}}, Precision::kDouble);
    scene.solver.substep = 1e-3 / (finer == 0 ? 1 : 2);
    Simulation simulation(scene);
    for (int frame = 0; frame < 30; ++frame) {
      ASSERT_TRUE(simulation.advance_frame());
      const Vector3d x = positions(simulation).col(1);
      EXPECT_NEAR(x.norm(), 1, 1e-12);
      const double phi = std::atan2(x.x(), -x.y());
      error[finer] = std::max(error[finer], std::abs(phi - pendulum(1, simulation.time())));
    }
  }
  EXPECT_LT(error[0], 2e-3);
  EXPECT_LT(error[1], 0.6 * error[0]);
}

TEST(Tethers, ThatReachNobodyChangeNoBit) {
  SheetDefinition without = soft_sheet(13, 400), idle = without;
  without.tether_stretch.reset();
  Simulation unpinned(hung_by(without, {})), tethered(hung_by(idle, {}));
  idle.tether_stretch = 1;
  Simulation pinned(hung_by(without, {{{0, 12}, {}}})), slack(hung_by(idle, {{{0, 12}, {}}}));
  for (int frame = 0; frame < 20; ++frame) {
    for (Simulation* each : {&unpinned, &tethered, &pinned, &slack})
      ASSERT_TRUE(each->advance_frame());
    EXPECT_EQ(positions(tethered), positions(unpinned));
    EXPECT_EQ(positions(slack), positions(pinned));
    EXPECT_EQ(velocities(slack), velocities(pinned));
  }
}

// RMS distance of a sheet hung from two corners from that of stiff cloth after half a second, m.
TEST(Tethers, BringSoftClothNearToStiffCloth) {
  const auto after = [](double stiffness, bool tethered) {
    SheetDefinition sheet = soft_sheet(17, stiffness);
    if (!tethered) sheet.tether_stretch.reset();
    Simulation simulation(hung_by(sheet, {{{0, 16}, {}}}));
    for (int frame = 0; frame < 30; ++frame) EXPECT_TRUE(simulation.advance_frame());
    return positions(simulation);
  };
  const Matrix3Xd stiff = after(20'000, false);
  const auto error = [&](const Matrix3Xd& x) { return (x - stiff).norm() / 17; };
  const double soft = error(after(100, false)), tethered = error(after(100, true));
  EXPECT_LT(3 * tethered, soft);
  EXPECT_LT(tethered, 0.02);
}

// A row, a corner and a particle inside, the last two led.
std::vector<Pin> many_pins(int side) {
  Pin row, corner{{side * (side - 1)}, shaken()}, inside{{side * side / 2}, shaken()};
  for (int i = 0; i < side; ++i) row.particles.push_back(i);
  return {row, corner, inside};
}

Matrix3Xd after_shaking(Scene scene, ThreadPool& pool = calling_thread()) {
  scene.solver.frame_step = 2e-3;
  Simulation simulation(scene);
  for (int frame = 0; frame < 25; ++frame) EXPECT_TRUE(simulation.advance_frame(pool));
  return positions(simulation);
}

TEST(Tethers, FromManyHeldParticlesAreInVectorsAsOneByOne) {
  for (const int side : {9, 17, 33}) {
    Scene scene = hung_by(soft_sheet(side, 50), many_pins(side), Precision::kDouble);
    const Matrix3Xd fast = after_shaking(scene);
    scene.solver.precision = Precision::kSingle;
    const Matrix3Xd single = after_shaking(scene);
    scene.solver.plain = true;
    const Matrix3Xd plain = after_shaking(scene);
    EXPECT_LT((fast - plain).cwiseAbs().maxCoeff(), 1e-9) << side;
    EXPECT_LT((single - plain).cwiseAbs().maxCoeff(), 1e-3) << side;
  }
}

TEST(Tethers, HaveTheSameBitsOnEveryProcessorAndHoweverManyHandsShareThem) {
  const Scene scene = hung_by(soft_sheet(132, 50), many_pins(132));
  LastFirst pool(4);
  const std::uint64_t alone = hash_of(after_shaking(scene));
  EXPECT_EQ(hash_of(after_shaking(scene, pool)), alone);
  for (const std::int64_t target : {HWY_AVX2, HWY_AVX3, HWY_NEON}) {
    if ((hwy::SupportedTargets() & target) == 0) continue;
    hwy::SetSupportedTargetsForTest(target);
    EXPECT_EQ(hash_of(after_shaking(scene)), alone) << hwy::TargetName(target);
    hwy::SetSupportedTargetsForTest(0);
  }
}

TEST(Tethers, OfAGrabbedParticleHoldUntilItIsReleased) {
  Simulation simulation(hung_by(soft_sheet(13, 20), {{{0}, {}}}));
  const auto act = [&](Action::Kind kind) {
    EXPECT_FALSE(simulation.act({{.kind = kind, .particle = 168}}));
  };
  const auto run = [&](int frames) {
    for (int frame = 0; frame < frames; ++frame) ASSERT_TRUE(simulation.advance_frame());
  };
  act(Action::Kind::kGrab);
  EXPECT_FALSE(simulation.act({{.kind = Action::Kind::kDrag,
                                .particle = 168,
                                .target = {0.5, 0.2, 0.5},
                                .duration = 0.5}}));
  run(60);
  EXPECT_LT(excess(simulation, 168), 1e-3);
  EXPECT_LT(excess(simulation, 0), 1e-3);
  EXPECT_EQ(make_tethers(simulation.scene().sheets[0]).size(), 2U);
  act(Action::Kind::kRelease);
  EXPECT_EQ(make_tethers(simulation.scene().sheets[0]).size(), 1U);
  run(20);
  EXPECT_LT(excess(simulation, 0), 1e-5);
}

TEST(Tethers, WhatStartsBeyondThemComesBackSlowly) {
  SheetDefinition sheet = soft_sheet(9, 0);
  sheet.start_positions = values(stretched(sheet, 0.05));
  Scene scene = hung_by(sheet, {{{0}, {}}});
  scene.environment.gravity.setZero();
  Simulation simulation(scene);
  for (int frame = 1; frame <= 30; ++frame) {
    ASSERT_TRUE(simulation.advance_frame());
    EXPECT_LT(velocities(simulation).colwise().norm().maxCoeff(), 1.01 * kInward) << frame;
  }
  EXPECT_LT(excess(simulation, 0), 1e-5);
}

TEST(Tethers, ArePassedOverAThousandHeldParticlesByNoMoreThanEightFromEach) {
  SheetDefinition sheet = soft_sheet(33, 50);
  Pin rings;
  for (int i = 0; i < sheet.particle_count(); i += 2)
    if (i / 33 % 2 == 0) rings.particles.push_back(i);
  sheet.pins = {rings};
  const Tethers tethers = make_tethers(sheet);
  EXPECT_EQ(tethers.size(), kMostAttachments);
  std::size_t held = 0;
  for (const Attachment& attachment : tethers) held += attachment.held.size();
  EXPECT_EQ(held, rings.particles.size());
}

TEST(Tethers, AreOneToARowThatIsHeldAndToEachCornerThatIs) {
  SheetDefinition sheet = soft_sheet(9, 50);
  sheet.pins = {{{0, 1, 2, 3, 4, 5, 6, 7, 8}, {}}, {{80}, {}}};
  const Tethers tethers = make_tethers(sheet);
  ASSERT_EQ(tethers.size(), 2U);
  EXPECT_EQ(tethers[0].held[static_cast<std::size_t>(tethers[0].nearest[40])], 4);
  EXPECT_DOUBLE_EQ(tethers[0].length[40], 0.5);
  EXPECT_DOUBLE_EQ(tethers[1].length[40], 0.5 * std::numbers::sqrt2);
  EXPECT_TRUE(std::isinf(tethers[0].length[80]));
}

// Around the corner of an L, 0.2 m wide: cut out of a square of 1 m.
TEST(Tethers, OfTrianglesFollowTheClothAroundCorners) {
  const RestShape whole = square(Cut::kAlternating, 1, 0.05);
  std::vector<std::array<int, 3>> kept;
  const std::vector<Vector2d> points = points_of(whole);
  for (const auto& triangle : whole.triangles) {
    bool inside = true;
    for (const int i : triangle) {
      const Vector2d& point = points[static_cast<std::size_t>(i)];
      inside = inside && (point.x() < 0.201 || point.y() < 0.201);
    }
    if (inside) kept.push_back(triangle);
  }
  const RestShape shape = rest_shape(points, kept);
  const auto at = [&](double u, double v) {
    int nearest = 0;
    for (int i = 0; i < shape.particles; ++i)
      if ((points[static_cast<std::size_t>(i)] - Vector2d(u, v)).norm() <
          (points[static_cast<std::size_t>(nearest)] - Vector2d(u, v)).norm())
        nearest = i;
    return nearest;
  };
  const auto particles = static_cast<std::size_t>(shape.particles);
  Tethers tethers = {{{at(1, 0)},
                      std::vector<int>(particles),
                      std::vector<double>(particles, std::numeric_limits<double>::infinity())}};
  measure_tethers(shape, tethers);
  const Attachment& attachment = tethers[0];
  const double way = 2 * std::hypot(0.8, 0.2);
  EXPECT_NEAR(attachment.length[static_cast<std::size_t>(at(0, 1))], way, 0.02 * way);
  for (int i = 0; i < shape.particles; ++i) {
    const auto particle = static_cast<std::size_t>(i);
    const double straight = (points[particle] - points[static_cast<std::size_t>(at(1, 0))]).norm();
    EXPECT_GT(attachment.length[particle], straight - 1e-9) << i;
    if (points[particle].y() > 0.201) continue;
    EXPECT_LT(attachment.length[particle], 1.02 * straight + 1e-9) << i;
  }
}

std::vector<std::string> warnings_of(const Scene& scene) {
  std::vector<std::string> codes;
  const Simulation simulation(scene);
  for (const Warning& warning : simulation.plan().warnings) codes.push_back(warning.code);
  return codes;
}

TEST(Tethers, AreWarnedOfWhereTheyMislead) {
  Scene scene = hung_by(soft_sheet(9, 5000), {});
  EXPECT_THAT(warnings_of(scene), Contains("TETHERS_IDLE"));
  const Simulation simulation(scene);
  EXPECT_THAT(simulation.plan().skipped,
              Contains(::testing::Field(&SkippedPass::pass, "sheet: tethers")));

  scene.sheets[0].pins = {{{0}, {}}};
  for (const char* code : {"TETHERS_IDLE", "TETHERS_STRAIGHT", "TETHERS_STIFFEN", "TETHERS_TAUT"})
    EXPECT_THAT(warnings_of(scene), Not(Contains(code)));
  scene.colliders = {{"floor", Plane{{0, -2, 0}, {0, 1, 0}}, 0.3, {}}};
  EXPECT_THAT(warnings_of(scene), Contains("TETHERS_STRAIGHT"));
  scene.sheets[0].start_positions = values(stretched(scene.sheets[0], 0.01));
  EXPECT_THAT(warnings_of(scene), Contains("TETHERS_TAUT"));
  Scene sheared = scene;
  std::get<RawTextile>(sheared.sheets[0].textile.model).shear = 50;
  EXPECT_THAT(warnings_of(sheared), Contains("TETHERS_STIFFEN"));
  std::get<RawTextile>(scene.sheets[0].textile.model).stretch = 50;
  EXPECT_THAT(warnings_of(scene), Contains("TETHERS_STIFFEN"));
}

TEST(Tethers, ThatWouldBeShorterThanTheClothAreRefused) {
  Scene scene = hung_by(soft_sheet(9, 50), {});
  scene.sheets[0].tether_stretch = -0.1;
  ASSERT_EQ(find_problems(scene).size(), 1U);
  EXPECT_EQ(find_problems(scene)[0].field, "sheets[0].tether_stretch");
}

}  // namespace
}  // namespace weft::testing

// Scenes that find_problems() allows and that nobody should run: each ends in a correct result, a
// refusal, or a repaired run; none in a hang, a crash or a frame that is not finite.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>

#include "core/motion/guard.h"
#include "core/triangles/cut.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

using ::testing::IsEmpty;

const Vector3d kGravity{0, -9.8, 0};

// Both precisions, and the plain solver.
std::vector<Scene> on_every_solver(Scene scene) {
  std::vector<Scene> scenes(3, scene);
  scenes[0].solver.precision = Precision::kSingle;
  scenes[1].solver.precision = Precision::kDouble;
  scenes[2].solver.plain = true;
  return scenes;
}

Scene scene_of(const SheetDefinition& sheet) {
  Scene scene = floating(sheet);
  scene.environment.gravity = kGravity;
  return scene;
}

SheetDefinition held(SheetDefinition sheet) {
  sheet.pins = {{{0, grid_of(sheet).columns - 1}, {}}};
  return sheet;
}

double farthest(const Simulation& simulation) {
  return positions(simulation).cwiseAbs().maxCoeff();
}

// Runs so many frames, each finite and within `reach` m of the origin.
Simulation run(const Scene& scene, int frames, double reach) {
  EXPECT_THAT(find_problems(scene), IsEmpty());
  Simulation simulation(scene);
  EXPECT_FALSE(simulation.refusal());
  for (int frame = 0; frame < frames; ++frame) {
    if (!simulation.advance_frame()) {
      ADD_FAILURE() << simulation.failure();
      break;
    }
    EXPECT_TRUE(velocities(simulation).allFinite());
    EXPECT_LT(farthest(simulation), reach) << "in frame " << simulation.frame();
    if (!(farthest(simulation) < reach)) break;
  }
  return simulation;
}

// All particles of a row in one place: no connection along it has a direction.
TEST(HostileScene, EdgesOfNoLengthUnfoldUnderTheWeight) {
  SheetDefinition sheet = held(flat_sheet(6, 6));
  Matrix3Xd x = start_positions(sheet);
  x.row(0).setZero();
  sheet.start_positions = values(x);
  for (const Scene& scene : on_every_solver(scene_of(sheet))) run(scene, 100, 0.5);
}

TEST(HostileScene, ASheetInOnePointStaysOneAndFalls) {
  SheetDefinition sheet = flat_sheet(5, 5);
  sheet.start_positions.assign(75, 0.0);
  for (const Scene& scene : on_every_solver(scene_of(sheet))) {
    const Simulation simulation = run(scene, 10, 1);
    const Matrix3Xd x = positions(simulation);
    const double t = simulation.time();
    EXPECT_LT((x.colwise() - Vector3d(0, -4.9 * t * t, 0)).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(HostileScene, AParticlePinnedInsideAColliderHoldsWhileTheOthersLieOnIt) {
  SheetDefinition sheet = flat_sheet(9, 9, 0.05);
  sheet.origin = {-0.2, 0, -0.2};
  sheet.textile.damping = 2e-2;
  sheet.pins = {{{40}, {}}};
  Scene scene = scene_of(sheet);
  scene.colliders = {{"ball", Sphere{{0, 0, 0}, 0.12}, 0.3, {}}};
  for (const Scene& each : on_every_solver(scene)) {
    const Simulation simulation = run(each, 100, 1);
    const Matrix3Xd x = positions(simulation);
    EXPECT_LT(x.col(40).norm(), 1e-12);
    for (int i = 0; i < 81; ++i) EXPECT_GT(i == 40 ? 1 : x.col(i).norm(), 0.12) << i;
    EXPECT_THAT(simulation.repairs(), IsEmpty());
  }
}

TEST(HostileScene, AColliderThatStartsInTheClothPushesItOutWithoutThrowingIt) {
  SheetDefinition sheet = flat_sheet(9, 9, 0.05);
  sheet.origin = {-0.2, 0.02, -0.2};
  sheet.textile.damping = 2e-2;
  Scene scene = scene_of(sheet);
  scene.colliders = {{"box", Box{{0, 0, 0}, {0.1, 0.1, 0.1}, Quaterniond::Identity()}, 1, {}},
                     {"floor", Plane{{0, -1, 0}, {0, 1, 0}}, 1, {}}};
  for (const Scene& each : on_every_solver(scene)) {
    const Simulation simulation = run(each, 100, 1.5);
    const Matrix3Xd x = positions(simulation);
    for (int i = 0; i < 81; ++i)
      EXPECT_GT(x.col(i).cwiseAbs().maxCoeff(), 0.1 - 1e-6) << i << " is inside the box";
  }
}

// 50 m/s for 20 ms, on the corner of a sheet that is free else.
TEST(HostileScene, APinThatMovesAt50MetresASecondTakesTheClothAlong) {
  SheetDefinition sheet = flat_sheet(9, 9, 0.02);
  sheet.pins = {{{0}, {{0, {0, 0, 0}}, {0.02, {1, 0, 0}}}}};
  sheet.textile.damping = 5e-2;
  for (const Scene& each : on_every_solver(scene_of(sheet))) {
    const Simulation simulation = run(each, 100, 5);
    EXPECT_LT((positions(simulation).col(0) - Vector3d(1, 0, 0)).norm(), 1e-6);
    EXPECT_LT(simulation.stats().largest_strain, 1);
  }
}

TEST(HostileScene, WithoutBendingOrItsClampASheetHangsFromItsPins) {
  for (const auto& [bend, clamp] : {std::pair(0.0, 2000.0), {1e-4, 0.0}, {0.0, 0.0}}) {
    SheetDefinition sheet = held(flat_sheet(9, 9));
    auto& raw = std::get<RawTextile>(sheet.textile.model);
    raw.bend = bend;
    raw.clamp = clamp;
    for (const Scene& each : on_every_solver(scene_of(sheet))) {
      const Simulation simulation = run(each, 100, 1);
      EXPECT_LT(simulation.stats().largest_strain, 0.2);
    }
  }
}

// One g, and one microgram, a particle: sheets do not touch each other's accuracy.
TEST(HostileScene, MassesAMillionfoldApartMoveAsTheyDoAlone) {
  SheetDefinition heavy = held(flat_sheet(5, 5)), light = heavy;
  light.name = "light";
  std::get<RawTextile>(light.textile.model).particle_mass = 1e-9;
  std::get<RawTextile>(light.textile.model).stretch = 0.2;
  std::get<RawTextile>(light.textile.model).shear = 0.2;
  std::get<RawTextile>(light.textile.model).bend = 1e-9;
  light.textile.damping = 2e-9;
  Scene alone = scene_of(light), both = alone;
  both.sheets.push_back(heavy);
  both.sheets[1].name = "heavy";
  alone.solver.substep = both.solver.substep = 1e-5;
  const Simulation a = run(alone, 20, 1), b = run(both, 20, 1);
  EXPECT_EQ(positions(b).leftCols(25), positions(a));
  EXPECT_THAT(b.repairs(), IsEmpty());
}

TEST(HostileScene, TheSmallestAndTheNarrowestSheetHang) {
  for (const auto& [rows, columns] : {std::pair(2, 2), {2, 500}, {500, 2}}) {
    SheetDefinition sheet = held(flat_sheet(rows, columns, 0.01));
    for (const Scene& each : on_every_solver(scene_of(sheet))) {
      const Simulation simulation = run(each, 30, 8);
      EXPECT_THAT(simulation.repairs(), IsEmpty());
    }
  }
}

TEST(HostileScene, OneSegmentBendsStrongerThanTheCurve) {
  SheetDefinition sheet = held(flat_sheet(9, 9));
  for (const bool folded : {false, true}) {
    sheet.bending = ChoiKo{.segments = 1, .fold_clamp = folded};
    for (const Scene& each : on_every_solver(scene_of(sheet)))
      EXPECT_LT(run(each, 100, 1).stats().largest_strain, 0.2);
  }
}

TEST(HostileScene, AStepForcedTo100MillisecondsIsRefusedOrRepaired) {
  Scene scene = scene_of(held(flat_sheet(9, 9)));
  scene.solver.frame_step = scene.solver.substep.emplace(0.1);
  EXPECT_TRUE(Simulation(scene).refusal());
  scene.solver.allow_unstable = true;
  for (const Scene& each : on_every_solver(scene)) {
    const Simulation simulation = run(each, 30, 2);
    EXPECT_GE(simulation.repairs().size(), 5u);
    EXPECT_LT(simulation.stats().largest_strain, 0.5);
  }
}

// Each integrator, forced to a step that is 20 times too long.
TEST(HostileScene, EveryIntegratorIsRepaired) {
  for (const auto kind :
       {IntegratorKind::kVerlet, IntegratorKind::kEuler, IntegratorKind::kMidpoint,
        IntegratorKind::kRk4, IntegratorKind::kLaggedVerlet}) {
    SheetDefinition sheet = held(flat_sheet(5, 5));
    sheet.textile.damping = 0.05;
    Scene scene = scene_of(sheet);
    scene.solver.integrator = kind;
    scene.solver.substep = 0.01;
    scene.solver.allow_unstable = true;
    EXPECT_FALSE(run(scene, 100, 1).repairs().empty());
  }
}

SheetDefinition woollen(const std::string& name, double side) {
  SheetDefinition sheet;
  sheet.name = name;
  sheet.shape = complete(triangle_mesh(cut_rectangle(Cut::kAlternating, side, side, 0.01)));
  sheet.textile.model = MeasuredTextile{.areal_density = 0.168,
                                        .tensile_warp = 2133,
                                        .tensile_weft = 1671,
                                        .shear = 26.17,
                                        .bend_rigidity_warp = 5.56e-6,
                                        .bend_rigidity_weft = 5.02e-6};
  sheet.bending = Isometric{};
  return sheet;
}

// A swatch of 10 cm that is held along its border, and a plate above it, held everywhere, whose rim
// is that far within, m; it is led down in 0.1 s.
Scene plate_through_swatch(double within, double down) {
  constexpr double kSide = 0.1;
  SheetDefinition swatch = woollen("swatch", kSide), plate = woollen("plate", kSide - 2 * within);
  const Matrix3Xd x = start_positions(swatch);
  Pin& border = swatch.pins.emplace_back();
  for (int i = 0; i < x.cols(); ++i) {
    const Vector3d from_middle = x.col(i) - Vector3d(kSide / 2, 0, kSide / 2);
    if (from_middle.cwiseAbs().maxCoeff() > kSide / 2 - 1e-9) border.particles.push_back(i);
  }
  plate.origin = {within, 0.004, within};
  Pin& all = plate.pins.emplace_back();
  for (int i = 0; i < plate.particle_count(); ++i) all.particles.push_back(i);
  all.path = {{0, Vector3d::Zero()}, {0.1, Vector3d(0, -down, 0)}};
  Scene scene;
  scene.sheets = {swatch, plate};
  scene.cloth_contact = true;
  scene.environment.gravity.setZero();
  return scene;
}

struct PassedThrough {
  std::int64_t most_cuts = 0, cuts = 0;  // in any frame; at the end
  double strain = 0;                     // largest in any frame
  std::size_t repairs = 0;
};

PassedThrough lead_down(const Scene& scene, int frames) {
  Simulation simulation(scene);
  PassedThrough passed;
  for (int frame = 0; frame < frames; ++frame) {
    if (!simulation.advance_frame()) {
      ADD_FAILURE() << simulation.failure();
      break;
    }
    const FrameStats stats = simulation.stats();
    passed.cuts = stats.cloth_cuts.value_or(-1);
    passed.most_cuts = std::max(passed.most_cuts, passed.cuts);
    passed.strain = std::max(passed.strain, stats.largest_strain);
  }
  passed.repairs = simulation.repairs().size();
  return passed;
}

TEST(HostileScene, APlateThatLeavesASwatchRoomDrawsItDownWithoutACut) {
  const PassedThrough passed = lead_down(plate_through_swatch(0.03, 0.012), 10);
  EXPECT_EQ(passed.most_cuts, 0);
  EXPECT_EQ(passed.repairs, 0U);
}

TEST(HostileScene, APlateLedThroughTheHeldBorderOfASwatchIsToldAsCutsAndLeavesItCalm) {
  const PassedThrough passed = lead_down(plate_through_swatch(0, 0.008), 10);
  EXPECT_GT(passed.cuts, 0);
  EXPECT_LT(passed.strain, 0.5);
  EXPECT_LE(passed.repairs, 2U);
}

TEST(HostileScene, WhatCannotComeApartIsNotThrownWhereCutsAreLedApart) {
  Scene scene = plate_through_swatch(0, 0.008);
  scene.untangle = 10;
  const PassedThrough passed = lead_down(scene, 10);
  EXPECT_GT(passed.cuts, 0);
  EXPECT_LT(passed.strain, 0.5);
  EXPECT_LE(passed.repairs, 3U);
}

TEST(HostileScene, APlateLedThroughAHeldSwatchAtOneAndAHalfMetresASecondComesOut) {
  for (const double within : {0.0, 1e-4}) {
    SCOPED_TRACE(within);
    const PassedThrough passed = lead_down(plate_through_swatch(within, 0.15), 6);
    EXPECT_GT(passed.most_cuts, 0);
    EXPECT_EQ(passed.cuts, 0);
  }
}

TEST(HostileScene, ARimThatShearsASwatchOffItsHeldBorderIsToldAsCuts) {
  const PassedThrough passed = lead_down(plate_through_swatch(0.00065, 0.008), 10);
  EXPECT_GT(passed.cuts, 0);
  EXPECT_LE(passed.repairs, 4U);
}

TEST(HostileScene, TwentyLayersThatFallTogetherOntoAHeldOneAreStopped) {
  SheetDefinition base = woollen("base", 0.06);
  Pin& all = base.pins.emplace_back();
  for (int i = 0; i < base.particle_count(); ++i) all.particles.push_back(i);
  Scene scene;
  scene.sheets = {base};
  scene.cloth_contact = true;
  scene.environment.gravity = kGravity;
  for (int layer = 0; layer < 20; ++layer) {
    SheetDefinition& sheet =
        scene.sheets.emplace_back(woollen("layer-" + std::to_string(layer), 0.04));
    sheet.origin = {0.01 + 2e-4 * layer, 0.8 + 0.00205 * layer, 0.01 + 1e-4 * layer};
  }
  const PassedThrough passed = lead_down(scene, 30);  // they meet in frame 25 at 4 m/s
  EXPECT_EQ(passed.most_cuts, 0);
  EXPECT_EQ(passed.repairs, 0U);
}

// One to three swatches across each other, some of them held in many places and led at up to
// 20 m/s.
Scene random_swatches(unsigned seed) {
  std::mt19937 random(seed);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<>(low, high)(random);
  };
  const auto any_of = [&](int most) { return std::uniform_int_distribution<>(0, most)(random); };
  const auto way = [&](double length) {
    return Vector3d(length * Vector3d(between(-1, 1), between(-1, 1), between(-1, 1)).normalized());
  };
  Scene scene;
  scene.cloth_contact = true;
  for (int count = any_of(2); count >= 0; --count) {
    SheetDefinition sheet = woollen("swatch-" + std::to_string(count), between(0.03, 0.06));
    const Vector3d turned = way(between(0, 3));
    sheet.rotation = Eigen::AngleAxisd(turned.norm(), turned.normalized());
    sheet.origin = way(0.03);
    const double share = std::array{0.0, 0.1, 1.0}[static_cast<std::size_t>(any_of(2))];
    const bool together = any_of(1) == 0;
    const double speed = std::exp(between(std::log(0.05), std::log(20))), time = between(0.01, 0.1);
    for (int i = 0; i < sheet.particle_count(); ++i) {
      if (between(0, 1) > share) continue;
      if (!together || sheet.pins.empty())
        sheet.pins.push_back({{}, {{0, Vector3d::Zero()}, {time, way(speed * time)}}});
      sheet.pins.back().particles.push_back(i);
    }
    scene.sheets.push_back(sheet);
  }
  return scene;
}

TEST(HostileScene, SwatchesAcrossEachOtherThatAreHeldAndLedAnywhereStayFinite) {
  constexpr double kReach = 10;  // m
  for (unsigned seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    EXPECT_LE(run(random_swatches(seed), 5, kReach).repairs().size(), 8U);
  }
}

}  // namespace
}  // namespace weft::testing

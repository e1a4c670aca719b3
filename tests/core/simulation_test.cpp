#include "core/simulation.h"

#include <gmock/gmock.h>
#include <malloc.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <numbers>
#include <vector>

#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

Scene hanging(double bend = 1e-5) {
  SheetDefinition sheet = flat_sheet(7, 7, 0.05);
  sheet.textile = paper_textile(bend);
  sheet.pins = {{{0, 6}, {}}};
  Scene scene = floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  return scene;
}

void run(Simulation& simulation, int frames) {
  for (int i = 0; i < frames; ++i) ASSERT_TRUE(simulation.advance_frame());
}

TEST(Simulation, FrameZeroIsTheInitialState) {
  const Scene scene = hanging();
  const Simulation simulation(scene);
  EXPECT_EQ(simulation.frame(), 0);
  EXPECT_EQ(positions(simulation), start_positions(scene.sheets[0]));
  EXPECT_LT(velocities(simulation).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(Simulation, StartVelocitiesAreThoseGivenForEveryIntegrator) {
  for (const auto integrator : {IntegratorKind::kVerlet, IntegratorKind::kEuler,
                                IntegratorKind::kMidpoint, IntegratorKind::kRk4}) {
    Scene scene = hanging();
    const Matrix3Xd v = noise(49);
    scene.sheets[0].start_velocities = values(v);
    scene.sheets[0].pins.clear();
    scene.solver.integrator = integrator;
    scene.solver.substep = 1e-5;
    scene.solver.allow_unstable = true;
    EXPECT_LT((velocities(Simulation(scene)) - v).cwiseAbs().maxCoeff(), 1e-10);
  }
}

TEST(Simulation, EqualScenesGiveEqualBits) {
  Simulation first(hanging()), second(hanging());
  run(first, 20);
  run(second, 20);
  const Matrix3Xd a = positions(first), b = positions(second);
  EXPECT_EQ(std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<std::size_t>(a.size())),
            0);
}

// What a frame is computed in is one for all simulations of a thread.
TEST(Simulation, SimulationsThatTakeTurnsDoNotDisturbEachOther) {
  Scene small = floating(flat_sheet(3, 4)), two = hanging();
  small.environment.gravity = {0, -9.8, 0};
  two.sheets.push_back(flat_sheet(5, 9));
  two.sheets.back().name = "second";
  std::vector<Simulation> together, alone;
  for (const Scene& scene : {two, small, hanging()}) {
    together.emplace_back(scene);
    run(alone.emplace_back(scene), 5);
  }
  for (int frame = 0; frame < 5; ++frame)
    for (Simulation& simulation : together) run(simulation, 1);
  for (std::size_t k = 0; k < alone.size(); ++k) {
    EXPECT_EQ(positions(together[k]), positions(alone[k]));
    EXPECT_EQ(velocities(together[k]), velocities(alone[k]));
    EXPECT_EQ(together[k].stats().kinetic_energy, alone[k].stats().kinetic_energy);
  }
}

TEST(Simulation, AHeldParticleNeverMovesAndALedOneNeverLeavesItsPath) {
  for (const auto integrator :
       {IntegratorKind::kVerlet, IntegratorKind::kRk4, IntegratorKind::kLaggedVerlet}) {
    Scene scene = hanging();
    scene.solver.integrator = integrator;
    const Path path = {
        {0, Vector3d::Zero()}, {0.1, Vector3d(0.2, 0.1, 0)}, {0.25, Vector3d(0, 0, 0.3)}};
    scene.sheets[0].pins = {{{0}, {}}, {{6}, path}};
    scene.colliders = {{"ball", Sphere{Vector3d(0.15, -0.3, 0.15), 0.1}, 0.3, {}}};
    Simulation simulation(scene);
    const Matrix3Xd start = start_positions(scene.sheets[0]);
    for (int frame = 0; frame < 40; ++frame) {
      run(simulation, 1);
      const Matrix3Xd x = positions(simulation);
      ASSERT_EQ(x.col(0), start.col(0));
      ASSERT_LT((x.col(6) - start.col(6) - offset_at(path, simulation.time())).norm(), 1e-15);
    }
  }
}

// 12 rows 0.05 m apart, of 0.01 kg a particle, hung by two.
Scene hung_strip(double stretch) {
  SheetDefinition sheet = flat_sheet(12, 2, 0.05);
  sheet.textile = {RawTextile{.particle_mass = 1e-2, .stretch = stretch, .air_drag = 0.2}, 0.05, 0};
  sheet.rotation = Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitX()));
  sheet.pins = {{{0, 1}, {}}};
  Scene scene = floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  return scene;
}

// The tension in a hanging strip is the weight below it: sum of m g / k over the rows.
TEST(Simulation, AStripHungByOneEndStretchesByItsOwnWeight) {
  Simulation simulation(hung_strip(200));
  while (!simulation.at_rest() && simulation.time() < 60) run(simulation, 1);
  ASSERT_TRUE(simulation.at_rest());
  double expected = 11 * 0.05;
  for (int below = 1; below <= 11; ++below) expected += below * 1e-2 * 9.8 / 200;
  EXPECT_NEAR(-positions(simulation)(1, 22), expected, 2e-4 * expected);
}

TEST(Simulation, APlanNamesWhatRunsAndWhatIsSkippedAndWhy) {
  Scene scene = hanging(0);
  const Plan plan = Simulation(scene).plan();
  const auto skipped = [&](const std::string& pass) {
    return std::any_of(plan.skipped.begin(), plan.skipped.end(),
                       [&](const SkippedPass& s) { return s.pass == pass && !s.reason.empty(); });
  };
  EXPECT_TRUE(skipped("sheet: bend"));
  EXPECT_TRUE(skipped("sheet: drag"));
  EXPECT_TRUE(skipped("wind"));
  EXPECT_TRUE(skipped("contact"));
  EXPECT_FALSE(skipped("sheet: stretch"));
}

std::vector<std::string> warnings(const Scene& scene) {
  std::vector<std::string> codes;
  const Simulation simulation(scene);
  for (const Warning& warning : simulation.plan().warnings) {
    codes.push_back(warning.code);
    EXPECT_THAT(warning_codes(), ::testing::Contains(warning.code));
  }
  return codes;
}

bool warns(const Scene& scene, const std::string& code) {
  const auto codes = warnings(scene);
  return std::find(codes.begin(), codes.end(), code) != codes.end();
}

TEST(Simulation, APlanWarnsOfWhatTheModelLeavesOut) {
  Scene scene = hanging();
  scene.sheets[0].textile.damping_ratio = 0.01;
  EXPECT_EQ(warnings(scene), std::vector<std::string>{"NO_SELF_COLLISION"});
  scene.sheets.push_back(scene.sheets[0]);
  scene.sheets[1].name = "other";
  scene.colliders = {{"table", Box{Vector3d::Zero(), Vector3d(1, 1, 1)}, 0.3, {}}};
  EXPECT_TRUE(warns(scene, "NO_SHEET_SHEET_COLLISION"));
  EXPECT_TRUE(warns(scene, "BOX_EDGES"));
  scene.cloth_contact = true;
  EXPECT_FALSE(warns(scene, "BOX_EDGES"));
}

// Of the lowest particle that falls on a rail.
double lowest_over(Scene scene, double radius) {
  scene.colliders = {{"rail", Capsule{{-1, -0.05, 0.05}, {2, -0.05, 0.05}, radius}, 0.3, {}}};
  const bool warned = warns(scene, "COLLIDER_THIN");
  Simulation simulation(std::move(scene));
  double lowest = 0;
  for (int frame = 0; frame < 20 && simulation.advance_frame(); ++frame)
    lowest = positions(simulation).row(1).minCoeff();
  EXPECT_EQ(warned, lowest < -0.1);
  return lowest;
}

TEST(Simulation, WarnsOfCollidersThatFitBetweenParticles) {
  SheetDefinition sheet = flat_sheet(2, 3, 0.1);  // two rows, 5 cm on either side of the rail
  sheet.skin = 0.005;
  Scene scene = floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  EXPECT_LT(lowest_over(scene, 0.04), -0.15);
  EXPECT_GT(lowest_over(scene, 0.05), -0.1);
  scene.colliders = {{"ball", Sphere{{0, -1, 0}, 0.064}, 0.3, {}}};
  EXPECT_TRUE(warns(scene, "COLLIDER_THIN"));
  scene.colliders = {{"ball", Sphere{{0, -1, 0}, 0.067}, 0.3, {}}};
  EXPECT_FALSE(warns(scene, "COLLIDER_THIN"));
}

TEST(Simulation, AStiffSheetWithoutADampingGetsTheSafeRatioAndAWarning) {
  Scene scene = hanging();
  scene.sheets[0].textile.damping = {};
  auto& textile = std::get<RawTextile>(scene.sheets[0].textile.model);
  textile.stretch = textile.shear = 2;
  EXPECT_FALSE(warns(scene, "UNDERDAMPED"));
  EXPECT_EQ(Simulation(scene).plan().dampings[0].damping, kDefaultDamping);

  textile.stretch = 23000;
  EXPECT_TRUE(warns(scene, "UNDERDAMPED"));
  const Plan plan = Simulation(scene).plan();
  EXPECT_GT(plan.dampings[0].damping, kDefaultDamping);
  EXPECT_NEAR(plan.dampings[0].ratio, kSafeDampingRatio, 0.1 * kSafeDampingRatio);
  EXPECT_GT(1.15 * plan.step.substep, scene.solver.safety * plan.step.linear_bound);
}

TEST(Simulation, ADampingGivenTooLowShortensTheStepAndAnAskedStepIsWarnedOf) {
  Scene scene = hanging();
  std::get<RawTextile>(scene.sheets[0].textile.model).stretch = 23000;
  scene.sheets[0].textile.damping_ratio = 0.01;
  const double damped = Simulation(scene).plan().step.substep;
  EXPECT_FALSE(warns(scene, "UNDERDAMPED"));

  scene.sheets[0].textile.damping_ratio = {};
  scene.sheets[0].textile.damping = 0;
  EXPECT_TRUE(warns(scene, "UNDERDAMPED"));
  EXPECT_NEAR(Simulation(scene).plan().step.substep, damped / 2, 0.05 * damped);

  scene.solver.substep = damped;
  EXPECT_TRUE(warns(scene, "UNDERDAMPED"));
  EXPECT_EQ(Simulation(scene).plan().step.substep, damped);
  scene.solver.substep = damped / 3;
  EXPECT_FALSE(warns(scene, "UNDERDAMPED"));
}

// Four particles on four springs: in the stiffest mode w^2 = 4 k / m, damped by 4 k_d / m = 2 ratio
// w.
TEST(Simulation, ADampingRatioIsThatOfTheStiffestMode) {
  Scene scene = hanging(0);
  SheetDefinition& sheet = scene.sheets[0];
  sheet.shape = Grid{.rows = 2, .columns = 2, .spacing = 0.05};
  sheet.pins.clear();
  auto& textile = std::get<RawTextile>(sheet.textile.model);
  textile.shear = 0;
  sheet.textile.damping_ratio = 0.2;
  const double m = textile.particle_mass, k = textile.stretch;
  const double expected = 2 * 0.2 * std::sqrt(4 * k / m) * m / 4;
  const Simulation simulation(scene);
  EXPECT_NEAR(simulation.plan().dampings[0].ratio, 0.2, 0.002);
  EXPECT_NEAR(simulation.plan().dampings[0].damping, expected, 0.01 * expected);
}

// The top connection carries 11 particles: 11 m g = k h 5 % is what the stiffness is capped to.
TEST(Simulation, ATextileTooStiffToNoticeMayBeSimulatedAsSoftAsASelfWeightStrainAllows) {
  Scene scene = hung_strip(1e5);
  const std::int64_t substeps = Simulation(scene).plan().step.substeps;
  EXPECT_FALSE(warns(scene, "STRETCH_CAPPED"));
  EXPECT_DOUBLE_EQ(Simulation(scene).plan().stretch_costs[0].self_weight_strain,
                   11 * 1e-2 * 9.8 / (0.05 * 1e5));

  scene.solver.max_self_weight_strain = 0.05;
  EXPECT_TRUE(warns(scene, "STRETCH_CAPPED"));
  Simulation simulation(scene);
  EXPECT_LT(6 * simulation.plan().step.substeps, substeps);
  while (!simulation.at_rest() && simulation.time() < 60) run(simulation, 1);
  double expected = 11 * 0.05;
  for (int below = 1; below <= 11; ++below) expected += below * 0.05 * 0.05 / 11;
  EXPECT_NEAR(-positions(simulation)(1, 22), expected, 2e-4 * expected);

  // what is softer stays as it is, also when it is set later
  std::get<RawTextile>(scene.sheets[0].textile.model).stretch = 200;
  EXPECT_FALSE(warns(scene, "STRETCH_CAPPED"));
  EXPECT_FALSE(simulation.set_textile(0, scene.sheets[0].textile));
  EXPECT_EQ(simulation.plan().step.substeps, Simulation(scene).plan().step.substeps);
}

TEST(Simulation, ATextileThatIsSimulatedSofterIsSoInShearToo) {
  Scene scene = hanging();
  auto& textile = std::get<RawTextile>(scene.sheets[0].textile.model);
  textile.stretch = textile.shear = 8000;
  scene.solver.max_self_weight_strain = 0.01;
  const Plan stiff = Simulation(scene).plan();
  const double soft = 8000 * stiff.stretch_costs[0].self_weight_strain / 0.01;
  textile.stretch = textile.shear = soft;
  const Plan as_soft = Simulation(scene).plan();
  EXPECT_EQ(stiff.step.substeps, as_soft.step.substeps);

  // a textile that shears easily keeps its shear
  textile = {.particle_mass = textile.particle_mass, .stretch = 8000, .shear = soft / 10};
  EXPECT_TRUE(warns(scene, "STRETCH_CAPPED"));
  Scene easy = scene;
  std::get<RawTextile>(easy.sheets[0].textile.model).stretch = soft;
  const double bound = Simulation(easy).plan().step.linear_bound;
  EXPECT_NEAR(Simulation(scene).plan().step.linear_bound, bound, 1e-9 * bound);
}

// c_b L^3 / k_b = 2000 x 0.1^3 / k_b falls below 31.47 at k_b = 0.0636; L is 0.1 on the axes.
TEST(Simulation, APlanWarnsWhereTheClampLeavesTheBendingConstantWithoutEffect) {
  for (const bool fold_clamp : {false, true}) {
    const auto scene_with = [&](double bend) {
      Scene scene = hanging(bend);
      scene.sheets[0].bending = ChoiKo{.fold_clamp = fold_clamp};
      return scene;
    };
    EXPECT_FALSE(warns(scene_with(0.063), "CLAMP_RULES"));
    EXPECT_TRUE(warns(scene_with(0.064), "CLAMP_RULES"));
  }
}

TEST(Simulation, UnderTheClampTwoBendingConstantsGiveTheSameBits) {
  Simulation soft(hanging(0.2)), stiff(hanging(0.6));
  run(soft, 10);
  run(stiff, 10);
  EXPECT_EQ(positions(soft), positions(stiff));
}

Scene measured_scene(double spacing, const MeasuredTextile& textile) {
  Scene scene = hanging();
  std::get<Grid>(scene.sheets[0].shape).spacing = spacing;
  scene.sheets[0].textile.model = textile;
  return scene;
}

MeasuredTextile cotton() {
  return {.areal_density = 0.15,
          .tensile_warp = 2000,
          .tensile_weft = 2000,
          .shear = 50,
          .bend_rigidity_warp = 1e-5,
          .bend_rigidity_weft = 1e-5};
}

// h_min = (96 B / (c_b kappa^2))^(1/4) / 2 with kappa = (rho g / B)^(1/3).
TEST(Simulation, APlanWarnsOfAMeshTooFineForInterlacedConnections) {
  const double kappa = std::cbrt(0.15 * 9.8 / 1e-5);
  const double finest = std::pow(96 * 1e-5 / (2000 * kappa * kappa), 0.25) / 2;
  EXPECT_FALSE(warns(measured_scene(1.01 * finest, cotton()), "MESH_TOO_FINE"));
  EXPECT_TRUE(warns(measured_scene(0.99 * finest, cotton()), "MESH_TOO_FINE"));
}

// kappa* = sqrt(288 k_b / (c_b L^5)), k_b = 4/9 B h.
TEST(Simulation, APlanStatesWhereBendingIsLost) {
  const double h = 0.01, length = 2 * h, k_b = 4.0 / 9 * 1e-5 * h;
  const Plan plan = Simulation(measured_scene(h, cotton())).plan();
  ASSERT_EQ(plan.bending_limits.size(), 1u);
  EXPECT_NEAR(plan.bending_limits[0].least_curvature,
              std::sqrt(288 * k_b / (2000 * std::pow(length, 5))), 1e-9);
  Scene isometric = measured_scene(h, cotton());
  isometric.sheets[0].bending = Isometric{};
  EXPECT_TRUE(Simulation(isometric).plan().bending_limits.empty());
}

TEST(Simulation, APlanWarnsOfTextilesThatALatticeCannotFollow) {
  MeasuredTextile textile = cotton();
  EXPECT_FALSE(warns(measured_scene(0.05, textile), "SHEAR_STIFFENS_TENSION"));
  EXPECT_FALSE(warns(measured_scene(0.05, textile), "BENDING_TOO_UNEQUAL"));
  textile.shear = 101;  // 2 G = 0.101 E
  textile.bend_rigidity_weft = 5.1e-5;
  EXPECT_TRUE(warns(measured_scene(0.05, textile), "SHEAR_STIFFENS_TENSION"));
  EXPECT_TRUE(warns(measured_scene(0.05, textile), "BENDING_TOO_UNEQUAL"));
}

TEST(Simulation, ASheetComesToRestAndIsToldSo) {
  Scene scene = hanging();
  std::get<RawTextile>(scene.sheets[0].textile.model).air_drag = 0.02;
  Simulation simulation(scene);
  EXPECT_FALSE(simulation.at_rest());
  while (!simulation.at_rest() && simulation.time() < 100) run(simulation, 1);
  EXPECT_TRUE(simulation.at_rest());
  EXPECT_LT(simulation.stats().kinetic_energy, 1e-6 * 49e-3 * 9.8 * 0.3);
}

TEST(Simulation, Of961ParticlesTakesAtMost128KiBWhilePacked) {
  const auto used = [] {
    const struct mallinfo2 now = mallinfo2();
    return now.uordblks + now.hblkhd;
  };
  Scene scene = floating(flat_sheet(31, 31));
  scene.solver.precision = Precision::kSingle;
  run(*std::make_unique<Simulation>(scene), 1);  // what a thread keeps
  const std::size_t before = used();
  Simulation simulation(scene);
  run(simulation, 1);
  if (used() == before) GTEST_SKIP() << "this allocator does not count";
  simulation.release_memory();
  EXPECT_LE(used() - before, 128u << 10);
}

TEST(Simulation, AnswersTheSameWhilePacked) {
  Simulation kept(hanging()), packed(hanging());
  run(kept, 5);
  run(packed, 5);
  packed.release_memory();
  EXPECT_EQ(packed.stats().potential_energy, kept.stats().potential_energy);
  packed.release_memory();
  EXPECT_EQ(positions(packed), positions(kept));
  packed.release_memory();
  EXPECT_EQ(velocities(packed), velocities(kept));
  packed.release_memory();
  const std::vector<Action> grab = {{.kind = Action::Kind::kGrab, .particle = 24}};
  EXPECT_EQ(packed.problems_of(grab).size(), 0u);
  packed.release_memory();
  ASSERT_FALSE(packed.act(grab));
  ASSERT_FALSE(kept.act(grab));
  packed.release_memory();
  Textile textile = packed.scene().sheets[0].textile;
  std::get<RawTextile>(textile.model).stretch *= 0.5;
  ASSERT_FALSE(packed.set_textile(0, textile));
  ASSERT_FALSE(kept.set_textile(0, textile));
  packed.release_memory();
  run(kept, 5);
  run(packed, 5);
  EXPECT_EQ(positions(packed), positions(kept));
}

TEST(Simulation, ASceneAtRestSleepsUntilItsTextileChanges) {
  Scene scene = hanging();
  std::get<RawTextile>(scene.sheets[0].textile.model).air_drag = 0.02;
  Simulation simulation(scene);
  while (!simulation.at_rest() && simulation.time() < 100) run(simulation, 1);
  EXPECT_GT(simulation.substeps(), 0);
  const Matrix3Xd x = positions(simulation);
  const double time = simulation.time();
  run(simulation, 10);
  EXPECT_EQ(simulation.substeps(), 0);
  EXPECT_EQ(positions(simulation), x);
  EXPECT_NEAR(simulation.time() - time, 10 * scene.solver.frame_step, 1e-9);

  Textile softer = scene.sheets[0].textile;
  std::get<RawTextile>(softer.model).stretch /= 10;
  ASSERT_FALSE(simulation.set_textile(0, softer));
  run(simulation, 10);
  EXPECT_GT(simulation.substeps(), 0);
  EXPECT_GT((positions(simulation) - x).cwiseAbs().maxCoeff(), 1e-4);
}

// A path that begins later is not slept through.
TEST(Simulation, ASceneWithAPathAheadStaysAwake) {
  SheetDefinition sheet = flat_sheet(3, 3);
  sheet.textile.damping = 1;
  Collider lift{"lift",
                Plane{Vector3d(0, -1, 0), Vector3d::UnitY()},
                0.3,
                {{1, Vector3d::Zero()}, {2, Vector3d(0, 2, 0)}}};
  Scene scene = floating(sheet);
  scene.colliders = {lift};
  Simulation simulation(scene);
  while (simulation.time() < 2.5) run(simulation, 1);
  EXPECT_GT(positions(simulation).row(1).minCoeff(), 0.9);
}

TEST(Simulation, AChangeOfTextileKeepsPositionsAndVelocities) {
  Simulation simulation(hanging());
  run(simulation, 20);
  const Matrix3Xd x = positions(simulation), v = velocities(simulation);
  Textile stiffer = paper_textile(1e-3);
  std::get<RawTextile>(stiffer.model).stretch = 8000;
  const double step = simulation.plan().step.substep;
  ASSERT_FALSE(simulation.set_textile(0, stiffer));
  EXPECT_LT(simulation.plan().step.substep, step);
  EXPECT_EQ(positions(simulation), x);
  // known to second order in the step on both sides
  EXPECT_LT((velocities(simulation) - v).cwiseAbs().maxCoeff(),
            0.01 * v.colwise().norm().maxCoeff());
}

// Hung and at rest.
Simulation at_rest() {
  Scene scene = hanging();
  std::get<RawTextile>(scene.sheets[0].textile.model).air_drag = 0.02;
  Simulation simulation(scene);
  while (!simulation.at_rest() && simulation.time() < 100) run(simulation, 1);
  EXPECT_TRUE(simulation.at_rest());
  return simulation;
}

double stretch_of(const Textile& textile) { return std::get<RawTextile>(textile.model).stretch; }

Textile with_stretch(Textile textile, double factor) {
  std::get<RawTextile>(textile.model).stretch *= factor;
  return textile;
}

TEST(Simulation, ATextileChangesOverTheTimeGivenAndStays) {
  Simulation simulation(hanging());
  run(simulation, 3);
  const Textile given = simulation.scene().sheets[0].textile, soft = with_stretch(given, 0.5);
  const double frame_step = simulation.scene().solver.frame_step;
  ASSERT_FALSE(simulation.set_textile(0, soft, 10 * frame_step));
  EXPECT_EQ(simulation.scene().sheets[0].textile, given);
  EXPECT_EQ(simulation.target_textile(0), soft);
  for (int frame = 1; frame <= 10; ++frame) {
    run(simulation, 1);
    EXPECT_TRUE(simulation.textile_changed());
    EXPECT_DOUBLE_EQ(stretch_of(simulation.scene().sheets[0].textile),
                     stretch_of(given) * (1 - 0.05 * frame));
  }
  run(simulation, 1);
  EXPECT_FALSE(simulation.textile_changed());
  EXPECT_EQ(simulation.scene().sheets[0].textile, soft);
  EXPECT_EQ(simulation.target_textile(0), soft);
}

TEST(Simulation, AnotherChangeOfATextileBeginsWhereTheFirstHasCome) {
  Simulation simulation(hanging());
  const Textile given = simulation.scene().sheets[0].textile;
  const double frame_step = simulation.scene().solver.frame_step;
  ASSERT_FALSE(simulation.set_textile(0, with_stretch(given, 3), 10 * frame_step));
  run(simulation, 5);
  EXPECT_DOUBLE_EQ(stretch_of(simulation.scene().sheets[0].textile), 2 * stretch_of(given));
  ASSERT_FALSE(simulation.set_textile(0, given, 2 * frame_step));
  run(simulation, 1);
  EXPECT_DOUBLE_EQ(stretch_of(simulation.scene().sheets[0].textile), 1.5 * stretch_of(given));
  ASSERT_FALSE(simulation.set_textile(0, with_stretch(given, 4)));
  EXPECT_EQ(stretch_of(simulation.scene().sheets[0].textile), 4 * stretch_of(given));
  run(simulation, 3);
  EXPECT_EQ(stretch_of(simulation.scene().sheets[0].textile), 4 * stretch_of(given));
}

// Springs that are at once a quarter as stiff let the sheet fall; over many of its periods they let
// it down.
TEST(Simulation, ATextileThatChangesOverASecondDoesNotJerkTheSheet) {
  const auto largest_acceleration = [](double duration) {
    Simulation simulation = at_rest();
    const Textile given = simulation.scene().sheets[0].textile;
    EXPECT_FALSE(simulation.set_textile(0, with_stretch(given, 0.25), duration));
    double largest = 0;
    Matrix3Xd before = velocities(simulation);
    while (simulation.time() < 100 && !simulation.at_rest()) {
      run(simulation, 1);
      const Matrix3Xd v = velocities(simulation);
      largest = std::max(largest, (v - before).colwise().norm().maxCoeff());
      before = v;
    }
    EXPECT_TRUE(simulation.at_rest());
    return largest / simulation.scene().solver.frame_step;
  };
  constexpr double kGravity = 9.8;
  const double at_once = largest_acceleration(0);
  EXPECT_GT(at_once, 0.1 * kGravity);
  EXPECT_LT(largest_acceleration(1), at_once / 10) << at_once;
}

TEST(Simulation, ASceneAtRestStaysAwakeWhileItsTextileChanges) {
  Simulation simulation = at_rest();
  const Textile given = simulation.scene().sheets[0].textile;
  const double duration = 120 * simulation.scene().solver.frame_step;
  ASSERT_FALSE(simulation.set_textile(0, with_stretch(given, 1.001), duration));
  for (int frame = 0; frame < 120; ++frame) {
    run(simulation, 1);
    ASSERT_GT(simulation.substeps(), 0) << frame;
  }
  EXPECT_EQ(simulation.scene().sheets[0].textile, with_stretch(given, 1.001));
  run(simulation, 60);
  EXPECT_TRUE(simulation.asleep());
}

TEST(Simulation, AChangeToATextileThatTheStepDoesNotBearIsRefusedBeforeItBegins) {
  Scene scene = hanging();
  scene.solver.substep = Simulation(scene).plan().step.linear_bound * 0.99;
  Simulation simulation(scene), left(scene);
  const Textile given = scene.sheets[0].textile;
  EXPECT_TRUE(simulation.set_textile(0, with_stretch(given, 100), 1));
  EXPECT_EQ(simulation.target_textile(0), given);
  run(simulation, 10);
  run(left, 10);
  EXPECT_EQ(positions(simulation), positions(left));
  EXPECT_FALSE(simulation.set_textile(0, with_stretch(given, 0.5), 0.1)) << "a softer one it does";
}

TEST(Simulation, SettingTheSameTextileChangesNoBit) {
  Simulation changed(hanging()), left(hanging());
  run(changed, 10);
  run(left, 10);
  ASSERT_FALSE(changed.set_textile(0, changed.scene().sheets[0].textile));
  run(changed, 10);
  run(left, 10);
  EXPECT_EQ(positions(changed), positions(left));
}

// On a taut sheet, where nothing switches, changing the step midway costs no order.
TEST(Simulation, AChangeOfStepIsOfSecondOrder) {
  const auto end = [](double safety) {
    Scene scene = hanging();
    SheetDefinition& sheet = scene.sheets[0];
    sheet.start_positions = values(stretched(sheet, 0.05));
    Matrix3Xd v = Matrix3Xd::Zero(3, 49);
    for (int i = 0; i < 49; ++i)
      v(1, i) = std::sin(std::numbers::pi * (i % 7) / 6) * std::sin(std::numbers::pi * (i / 7) / 6);
    sheet.start_velocities = values(v);
    sheet.pins = {Pin{}};
    for (int i = 0; i < 49; ++i)
      if (i % 7 == 0 || i % 7 == 6 || i < 7 || i >= 42) sheet.pins[0].particles.push_back(i);
    scene.solver.safety = safety;
    Simulation simulation(scene);
    run(simulation, 2);
    Textile damped = paper_textile();
    damped.damping = 0.05;  // a shorter step
    const double step = simulation.plan().step.substep;
    EXPECT_FALSE(simulation.set_textile(0, damped));
    EXPECT_LT(simulation.plan().step.substep, 0.95 * step);
    run(simulation, 1);
    return positions(simulation);
  };
  const Matrix3Xd truth = end(0.01);
  const double coarse = (end(0.4) - truth).norm(), fine = (end(0.2) - truth).norm();
  EXPECT_GT(coarse / fine, 3.3);
}

TEST(Simulation, ARefusedTextileChangesNothing) {
  Scene scene = hanging();
  scene.solver.substep = Simulation(scene).plan().step.linear_bound * 0.99;
  Simulation simulation(scene), left(scene);
  Textile stiffer = paper_textile();
  std::get<RawTextile>(stiffer.model).stretch = 1e5;
  EXPECT_TRUE(simulation.set_textile(0, stiffer));
  run(simulation, 5);
  run(left, 5);
  EXPECT_EQ(positions(simulation), positions(left));
}

TEST(Simulation, ADivergedRunIsReportedNotPublished) {
  Scene scene = hanging();
  scene.solver.substep = 0.01;
  scene.solver.allow_unstable = true;
  scene.solver.max_repairs = 0;
  Simulation simulation(scene);
  int frames = 0;
  while (simulation.advance_frame() && frames < 10000) ++frames;
  EXPECT_LT(frames, 10000);
  EXPECT_EQ(simulation.frame(), frames);
}

TEST(Simulation, SheetsInOneSceneMoveAsTheyDoAlone) {
  Scene one = hanging(), other = hanging(1e-4), both = hanging();
  other.sheets[0].name = "other";
  other.sheets[0].shape = Grid{4, 9, 0.05};
  other.sheets[0].pins = {{{0, 8}, {}}};
  both.sheets.push_back(other.sheets[0]);
  for (Scene* scene : {&one, &other, &both}) scene->solver.substep = 1e-4;
  Simulation a(one), b(other), together(both);
  run(a, 10);
  run(b, 10);
  run(together, 10);
  const Matrix3Xd all = positions(together);
  EXPECT_EQ(all.leftCols(49), positions(a));
  EXPECT_EQ(all.rightCols(36), positions(b));
}

}  // namespace
}  // namespace weft::testing

#include <gmock/gmock.h>
#include <hwy/targets.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>

#include "core/contact/contact.h"
#include "core/lattice/law.h"
#include "tests/support/core/last_first.h"
#include "tests/support/core/scenes.h"

// The vector kernels are held to the plain solver, which evaluates one connection after the other.
namespace weft::testing {
namespace {

constexpr int kSteps = 4;

// A crumpled sheet in motion, two corners held.
Scene crumpled(SheetDefinition sheet, const std::optional<Wind>& wind = {}) {
  const double h = sheet.spacing();
  const int n = sheet.particle_count();
  sheet.start_positions = values(start_positions(sheet) + 0.3 * h * noise(n));
  sheet.start_velocities = values(0.5 * noise(n, 2));
  sheet.pins = {{{0, grid_of(sheet).columns - 1}, {}}};
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

// Rounding puts k eps (|x| + l) into a force, |x| the sheet's extent; 12 connections a particle,
// each of less than 16 roundings; with k dt^2 / m below the bound's 1 / 2 an acceleration error of
// every step adds up to n (n + 1) / 2 of them.
double tolerance(const Scene& scene, double epsilon) {
  const Grid& grid = grid_of(scene.sheets[0]);
  const double extent = grid.spacing * (std::max(grid.rows, grid.columns) + 2);
  return epsilon * extent * 12 * 16 * 0.5 * kSteps * (kSteps + 1) / 2;
}

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
    const double most = tolerance(scene, epsilon);
    EXPECT_LE((positions(fast) - positions(plain)).cwiseAbs().maxCoeff(), most)
        << what << (single ? ", single" : ", double");
    EXPECT_LE((velocities(fast) - velocities(plain)).cwiseAbs().maxCoeff() * *scene.solver.substep,
              4 * most)
        << what << (single ? ", single" : ", double");
  }
}

constexpr std::pair<int, int> kSizes[] = {{2, 2},   {2, 3},   {3, 2},   {4, 5},   {5, 16},
                                          {6, 17},  {7, 18},  {16, 19}, {17, 33}, {31, 31},
                                          {33, 34}, {40, 35}, {3, 64},  {70, 33}};

struct Feature {
  const char* name;
  void (*set)(SheetDefinition&);
};

Textile measured(double shear, double drag, double damping) {
  MeasuredTextile textile;
  textile.areal_density = 0.2;
  textile.tensile_warp = 900;
  textile.tensile_weft = 600;
  textile.shear = shear;
  textile.bend_rigidity_warp = 2e-4;
  textile.bend_rigidity_weft = 1e-4;
  textile.air_drag = drag;
  return {textile, damping, 0.3};
}
RawTextile& raw(SheetDefinition& sheet) { return std::get<RawTextile>(sheet.textile.model); }

ChoiKo optimal_law(int segments) { return {.segments = segments, .optimal_breakpoints = true}; }

const Feature kFeatures[] = {
    {"EverythingOn", [](SheetDefinition&) {}},
    {"NoDamping", [](SheetDefinition& s) { s.textile.damping = 0; }},
    {"NoShear", [](SheetDefinition& s) { raw(s).shear = 0; }},
    {"NoStretch", [](SheetDefinition& s) { raw(s).stretch = 0, raw(s).clamp = 100; }},
    {"NoBend", [](SheetDefinition& s) { raw(s).bend = 0; }},
    {"NoBendNoShearNoDamping",
     [](SheetDefinition& s) { s.textile.damping = raw(s).bend = raw(s).shear = 0; }},
    {"NoDiagonalBend", [](SheetDefinition& s) { s.bending = ChoiKo{.diagonal_bend = false}; }},
    {"NoDiagonalBendNoShear",
     [](SheetDefinition& s) { raw(s).shear = 0, s.bending = ChoiKo{.diagonal_bend = false}; }},
    {"Drag", [](SheetDefinition& s) { raw(s).air_drag = 0.02; }},
    {"TwoSegments", [](SheetDefinition& s) { s.bending = ChoiKo{.segments = 2}; }},
    {"SixtySegments", [](SheetDefinition& s) { s.bending = ChoiKo{.segments = 60}; }},
    {"OptimalBreakpoints", [](SheetDefinition& s) { s.bending = optimal_law(32); }},
    {"SixtySegmentsAtOptimalBreakpoints", [](SheetDefinition& s) { s.bending = optimal_law(60); }},
    {"ThreeSegmentsAtOptimalBreakpointsNoDiagonalBendNoShear",
     [](SheetDefinition& s) {
       ChoiKo law = optimal_law(3);
       law.diagonal_bend = false;
       raw(s).shear = 0, s.bending = law;
     }},
    {"SixtySegmentsNoDiagonalBendNoShear",
     [](SheetDefinition& s) {
       raw(s).shear = 0, s.bending = ChoiKo{.segments = 60, .diagonal_bend = false};
     }},
    {"PolynomialNoDiagonalBendNoShear",
     [](SheetDefinition& s) {
       raw(s).shear = 0;
       s.bending = ChoiKo{.evaluator = Evaluator::kPolynomial, .diagonal_bend = false};
     }},
    {"FoldedClamp",
     [](SheetDefinition& s) { s.bending = ChoiKo{.segments = 5, .fold_clamp = true}; }},
    {"Polynomial",
     [](SheetDefinition& s) { s.bending = ChoiKo{.evaluator = Evaluator::kPolynomial}; }},
    {"PolynomialOfDegree1",
     [](SheetDefinition& s) {
       s.bending = ChoiKo{.evaluator = Evaluator::kPolynomial, .degree = 1};
     }},
    {"ClampRules", [](SheetDefinition& s) { raw(s).bend = 0.1; }},
    {"Isometric", [](SheetDefinition& s) { s.bending = Isometric{}; }},
    {"IsometricShortenedAtNoCost",
     [](SheetDefinition& s) { s.bending = Isometric{.resist_compression = false}; }},
    {"IsometricMeasuredWithDrag",
     [](SheetDefinition& s) { s.textile = measured(20, 0.1, 1e-3), s.bending = Isometric{}; }},
    {"Tethered", [](SheetDefinition& s) { s.tether_stretch = 0; }},
    {"Measured", [](SheetDefinition& s) { s.textile = measured(20, 0, 1e-3); }},
    {"MeasuredNoShear", [](SheetDefinition& s) { s.textile = measured(0, 0.1, 0); }},
};

class Kernels : public ::testing::TestWithParam<Feature> {};

TEST_P(Kernels, FollowThePlainSolverOnEverySize) {
  for (const auto& [rows, columns] : kSizes) {
    SheetDefinition sheet = flat_sheet(rows, columns);
    GetParam().set(sheet);
    expect_like_plain(sheet, std::to_string(rows) + " x " + std::to_string(columns));
  }
}

TEST_P(Kernels, FollowThePlainSolverInWind) {
  Wind wind;
  wind.velocity = {3, 1, -5};
  wind.gust = 0.5;
  wind.gust_period = 1e-3;
  wind.tangential_drag = 0.05;
  for (const auto& [rows, columns] : {std::pair(2, 2), std::pair(5, 16), std::pair(17, 35)}) {
    SheetDefinition sheet = flat_sheet(rows, columns);
    GetParam().set(sheet);
    expect_like_plain(sheet, std::to_string(rows) + " x " + std::to_string(columns), wind);
  }
}

// Every value of the lattice after some sweeps from fixed positions; `padding`: those of lanes
// without a column, at the end.
template <class T>
std::vector<T> swept(const SheetDefinition& sheet, int bands = 1,
                     std::vector<T>* padding = nullptr) {
  using State = SweepState<T>;
  SweepLaw<T> law = make_sweep_law<T>(sheet);
  law.damping = static_cast<T>(*sheet.textile.damping / (2 * 1e-4));
  law.drift = {0, T(-1e-7), 0};
  law.wind = {true, {T(2), T(-1), T(4)}, T(1 / 6e-4), T(0.1), T(0.01)};
  State state(law.layout, law.compensated);
  LastFirst pool(3);
  const Matrix3Xd x = start_positions(sheet) + 0.01 * noise(sheet.particle_count());
  std::vector<T> out;
  for (int step = -1; step < 3; ++step) {
    if (step >= 0) sweep(law, state, bands, pool);
    for (int i = 0; i < sheet.particle_count(); ++i) {
      const int r = i / grid_of(sheet).columns, c = i % grid_of(sheet).columns;
      for (int axis = 0; axis < 3 && step < 0; ++axis)
        state.place(r, c)[State::kX + axis] = static_cast<T>(x(axis, i));
      if (step < 0) state.place(r, c)[State::kStep2] = T(1e-5);
      for (int plane = 0; plane < state.planes() && step >= 0; ++plane)
        out.push_back(state.place(r, c)[plane]);
    }
  }
  const LatticeLayout<T>& layout = law.layout;
  for (int r = 0; r < layout.rows && padding != nullptr; ++r)
    for (int c = layout.columns; c < layout.vectors() * layout.kLanes; ++c)
      for (int plane = 0; plane < state.planes(); ++plane)
        padding->push_back(state.place(r, c)[plane]);
  return out;
}

template <class T>
void expect_empty_padding(const SheetDefinition& sheet) {
  std::vector<T> padding;
  swept<T>(sheet, 1, &padding);
  EXPECT_FALSE(padding.empty());
  EXPECT_THAT(padding, ::testing::Each(T(0)));
}

TEST_P(Kernels, LeaveTheirPaddingEmpty) {
  for (const auto& [rows, columns] : {std::pair(5, 15), std::pair(4, 31), std::pair(6, 37)}) {
    SheetDefinition sheet = flat_sheet(rows, columns);
    GetParam().set(sheet);
    expect_empty_padding<float>(sheet);
    expect_empty_padding<double>(sheet);
  }
}

TEST_P(Kernels, GiveTheSameBitsInAnyNumberOfBands) {
  SheetDefinition sheet = flat_sheet(11, 37);
  GetParam().set(sheet);
  const auto single = swept<float>(sheet);
  const auto twofold = swept<double>(sheet);
  for (const int bands : {2, 3, 7, 11}) {
    EXPECT_EQ(swept<float>(sheet, bands), single) << bands;
    EXPECT_EQ(swept<double>(sheet, bands), twofold) << bands;
  }
}

TEST_P(Kernels, FollowThePlainSolverWithVelocitiesOfHalfAStepAgo) {
  Wind wind;
  wind.velocity = {3, 1, -5};
  for (const auto& [rows, columns] : {std::pair(2, 3), std::pair(17, 35)}) {
    SheetDefinition sheet = flat_sheet(rows, columns);
    GetParam().set(sheet);
    expect_like_plain(sheet, std::to_string(rows) + " x " + std::to_string(columns), wind,
                      IntegratorKind::kLaggedVerlet);
  }
}

TEST_P(Kernels, FollowThePlainSolverWhereSlowForcesActRarely) {
  Wind wind;
  wind.velocity = {3, 1, -5};
  wind.tangential_drag = 0.05;
  for (const auto& [rows, columns] : {std::pair(2, 3), std::pair(17, 35)}) {
    SheetDefinition sheet = flat_sheet(rows, columns);
    GetParam().set(sheet);
    expect_like_plain(sheet, std::to_string(rows) + " x " + std::to_string(columns), wind,
                      IntegratorKind::kVerlet, 3);
  }
}

INSTANTIATE_TEST_SUITE_P(Sheets, Kernels, ::testing::ValuesIn(kFeatures),
                         [](const auto& feature) { return std::string(feature.param.name); });

std::uint64_t hash_of_run(Precision precision, std::int64_t target) {
  hwy::SetSupportedTargetsForTest(target);
  Scene scene = crumpled(flat_sheet(23, 37));
  scene.solver.precision = precision;
  scene.solver.substep = scene.solver.frame_step = 2e-4;
  const Simulation simulation = after(scene, 200);
  hwy::SetSupportedTargetsForTest(0);
  return hash_of(positions(simulation));
}

// What is rounded once for all connections adds up along a sheet: a tenth of what positions round.
TEST(SinglePrecision, HasConnectionsOfTheRightLength) {
  for (const double spacing : {1.0 / 15, 1.0 / 30, 1.0 / 316, 0.013, 0.017}) {
    const auto law = make_sweep_law<float>(flat_sheet(5, 5, spacing));
    const auto expect = [&](float stiffness, float rest, double length) {
      EXPECT_NEAR(double{rest} / stiffness / length, 1, 6e-9) << length;
    };
    for (const auto& stretch : {law.warp, law.weft, law.warp_edge})
      expect(stretch.stiffness, stretch.rest, spacing);
    expect(law.shear.stiffness, law.shear.rest, spacing * std::numbers::sqrt2);
    for (const auto* bend : {&law.along_warp, &law.along_weft, &law.along_warp_edge})
      expect(bend->clamp, bend->clamp_rest, 2 * spacing);
  }
}

// Golden hashes: they guard that results repeat to the bit, not that they are right.
TEST(Repeatability, RunsHaveTheSameBitsOnEveryProcessorWithFma) {
  int targets = 0;
  for (const std::int64_t target : {HWY_AVX2, HWY_AVX3, HWY_NEON}) {
    if ((hwy::SupportedTargets() & target) == 0) continue;
    ++targets;
    EXPECT_EQ(hash_of_run(Precision::kSingle, target), 17795272851995772656u)
        << hwy::TargetName(target);
    EXPECT_EQ(hash_of_run(Precision::kDouble, target), 12083120177231884424u)
        << hwy::TargetName(target);
  }
  if (targets == 0) GTEST_SKIP() << "this processor has no FMA";
}

TEST(Repeatability, RunsHaveTheSameBitsHoweverManyHandsShareThem) {
  Scene scene = crumpled(flat_sheet(96, 130));
  scene.colliders = {{"ball", Sphere{Vector3d(0.4, -0.2, 0.4), 0.2}, 0.3, {}}};
  Simulation alone(scene), shared(scene);
  EXPECT_EQ(shared.most_threads(), 3);
  LastFirst pool(3);
  for (int frame = 0; frame < 20; ++frame) {
    ASSERT_TRUE(alone.advance_frame());
    ASSERT_TRUE(shared.advance_frame(pool));
  }
  EXPECT_EQ(positions(shared), positions(alone));
  EXPECT_EQ(velocities(shared), velocities(alone));
}

// Where the plain path looks at every particle in every step, the fast one looks when it must.
TEST(FarContacts, AreSkippedWithoutMissingOne) {
  SheetDefinition sheet = flat_sheet(15, 15);
  Scene scene = floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  scene.colliders = {{"ball", Sphere{Vector3d(0.2, -0.3, 0.2), 0.2}, 0.3, {}},
                     {"lift",
                      Plane{Vector3d(0, -0.6, 0), Vector3d::UnitY()},
                      0.3,
                      {{0, Vector3d::Zero()}, {0.2, Vector3d(0, 0.1, 0)}}}};
  Simulation fast(scene);
  scene.solver.plain = true;
  Simulation plain(scene);
  for (int frame = 0; frame < 30; ++frame) {
    ASSERT_TRUE(fast.advance_frame());
    ASSERT_TRUE(plain.advance_frame());
    const Matrix3Xd x = positions(fast);
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      for (const Collider& collider : scene.colliders)
        ASSERT_GE(distance(collider, x.col(i), fast.time()).value, 0) << frame;
    if (frame < 20) {
      ASSERT_LE((x - positions(plain)).cwiseAbs().maxCoeff(), 1e-9) << frame;
    }
  }
}

}  // namespace
}  // namespace weft::testing

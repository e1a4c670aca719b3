#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "core/sheet_factory.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/triangle_meshes.h"
#include "tests/support/core/wrapped_solver.h"

namespace weft::testing {
namespace {

MeasuredTextile supple(double rigidity) {
  return {.areal_density = 0.2,
          .tensile_warp = 800,
          .tensile_weft = 600,
          .shear = 100,
          .bend_rigidity_warp = rigidity,
          .bend_rigidity_weft = rigidity,
          .air_drag = 0};
}

// Hangs by two corners; what bends it changes slowly.
Scene hung(int slow_every, double rigidity = 1e-5) {
  SheetDefinition sheet = flat_sheet(15, 15, 1.0 / 14);
  sheet.textile = {supple(rigidity), 0.02, 0.3};
  sheet.bending = Isometric{};
  sheet.pins = {{{0, 14}, {}}};
  Scene scene = floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  scene.solver.precision = Precision::kDouble;
  scene.solver.slow_forces_every = slow_every;
  return scene;
}

Matrix3Xd ran(Scene scene, int frames) {
  Simulation simulation(std::move(scene));
  for (int k = 0; k < frames; ++k) EXPECT_TRUE(simulation.advance_frame());
  return positions(simulation);
}

double apart(const Matrix3Xd& a, const Matrix3Xd& b) {
  return std::sqrt((a - b).colwise().squaredNorm().mean());
}

TEST(SlowForces, AreOfSecondOrderInTheTimeBetweenThem) {
  const auto bent = [](int slow_every, double substep) {
    Scene scene = hung(slow_every, 1e-3);
    scene.sheets[0].textile.damping.reset();  // next to none
    scene.environment.gravity.setZero();
    // a bend whose own oscillation the step resolves well
    Matrix3Xd x = start_positions(scene.sheets[0]);
    for (Eigen::Index i = 0; i < x.cols(); ++i) x(1, i) += 5e-3 * std::cos(3 * x(0, i));
    scene.sheets[0].start_positions = values(x);
    scene.solver.substep = substep;
    const Simulation simulation(scene);
    EXPECT_EQ(simulation.plan().step.slow_every, slow_every);
    return ran(scene, 12);
  };
  constexpr double kStep = 1.0 / 60 / 512;
  const Matrix3Xd truth = bent(1, kStep / 8);
  const double error = apart(bent(8, kStep), truth), halved = apart(bent(8, kStep / 2), truth);
  RecordProperty("rms_m", std::to_string(error * 1e9) + " nm");
  EXPECT_LT(error, 1e-6);
  EXPECT_NEAR(error / halved, 4, 0.6);
}

// Much of the wind depends on velocities, which do not know yet of what it is about to do. The wind
// gives 100 m/s^2 at first; a velocity that is half of 8 substeps old would be 0.014 m/s off.
TEST(SlowForces, OfWindAreFeltAtTheVelocityAmidTheirImpulseAndFramesShowWhatTheyLeave) {
  for (const bool triangles : {false, true}) {
    const auto blown = [&](int slow_every) {
      Scene scene = hung(slow_every, 1e-6);
      if (triangles) scene.sheets[0].shape = complete(triangle_mesh(scattered(15, 1.0 / 14)));
      scene.environment.gravity.setZero();
      scene.environment.wind = Wind{.velocity = {1, 2, 6}, .tangential_drag = 0.2};
      scene.solver.substep = 1.0 / 60 / 512;
      Simulation simulation(scene);
      EXPECT_EQ(simulation.plan().step.slow_every, slow_every);
      for (int k = 0; k < 6; ++k) EXPECT_TRUE(simulation.advance_frame());
      return std::pair(positions(simulation), velocities(simulation));
    };
    const auto each = blown(1), rarely = blown(8);
    EXPECT_LT(apart(each.first, rarely.first), 1e-6);
    EXPECT_LT(apart(each.second, rarely.second), 1e-4);
  }
}

TEST(SlowForces, LetASheetFallThroughAirAsItsEquationSays) {
  constexpr double kRate = 2, kGravity = 9.8;  // 1/s, m/s^2
  for (const int slow_every : {1, 4, 12}) {
    Scene scene = hung(slow_every);
    auto& textile = std::get<MeasuredTextile>(scene.sheets[0].textile.model);
    textile.air_drag = kRate * textile.areal_density;
    scene.sheets[0].pins.clear();
    Simulation simulation(scene);
    EXPECT_EQ(simulation.plan().step.slow_every, slow_every);
    for (int k = 0; k < 60; ++k) ASSERT_TRUE(simulation.advance_frame());
    const double fallen = start_positions(scene.sheets[0])(1, 0) - positions(simulation)(1, 0);
    const double time = simulation.time();
    const double wanted = kGravity / kRate * (time - (1 - std::exp(-kRate * time)) / kRate);
    EXPECT_NEAR(fallen, wanted, 5e-5 * wanted) << slow_every;
  }
}

TEST(SlowForces, ChangeAHungSheetByMuchLessThanDraftIsOff) {
  for (const bool windy : {false, true}) {
    const auto after_a_fifth = [&](int slow_every) {
      Scene scene = hung(slow_every);
      if (windy) scene.environment.wind = Wind{.velocity = {1, 0, 3}};
      EXPECT_EQ(Simulation(scene).plan().step.slow_every, slow_every);
      return ran(scene, 20);
    };
    const Matrix3Xd each = after_a_fifth(1);
    for (const int slow_every : {2, 4})
      EXPECT_LT(apart(after_a_fifth(slow_every), each), windy ? 1e-5 : 2e-6) << slow_every;
  }
}

// Notes how strongly slow forces act in each step.
class Noting : public WrappedSolver {
 public:
  Noting(std::unique_ptr<SheetSolver> solver, std::vector<int>& noted)
      : WrappedSolver(std::move(solver)), noted_(noted) {}
  void advance(double time, int slow, ThreadPool& pool) override {
    noted_.push_back(slow);
    WrappedSolver::advance(time, slow, pool);
  }

 private:
  std::vector<int>& noted_;
};

TEST(SlowForces, AreAskedForOnceAmidAGroupOfSubstepsAndStandForAllOfThem) {
  Scene scene = hung(4);
  scene.solver.substep = scene.solver.frame_step / 90;
  std::vector<int> noted;
  Simulation simulation(scene, [&](const Scene& given, const SheetDefinition& sheet,
                                   const Mesh& mesh, const Dynamics& dynamics) {
    return std::make_unique<Noting>(make_solver(given, sheet, mesh, dynamics), noted);
  });
  ASSERT_TRUE(simulation.advance_frame());
  ASSERT_EQ(noted.size(), 90);
  for (std::size_t k = 0; k < 88; ++k) ASSERT_EQ(noted[k], k % 4 == 2 ? 4 : 0) << k;
  EXPECT_EQ(noted[88], 0);
  EXPECT_EQ(noted[89], 2);
}

TEST(SlowForces, ActOftenerWhereTheyAreNotSlowBesideTheStep) {
  const auto every = [](const Scene& scene) { return Simulation(scene).plan().step.slow_every; };
  EXPECT_EQ(every(hung(12)), 12);
  EXPECT_EQ(every(hung(16, 0.05)), 1);  // as stiff in bending as in its plane

  Scene undamped = hung(16);  // impulses in time with a mode feed it
  undamped.sheets[0].textile.damping = 0;
  EXPECT_EQ(every(undamped), 1);

  Scene stormy = hung(16);
  stormy.environment.wind = Wind{.velocity = {0, 0, 60}};
  EXPECT_THAT(every(stormy), ::testing::AllOf(::testing::Ge(1), ::testing::Lt(8)));

  Scene other = hung(16);
  other.solver.integrator = IntegratorKind::kRk4;
  EXPECT_EQ(every(other), 1);
}

// The other sheet, whose step and forces stay, has to know of it, or a snapshot would.
TEST(SlowForces, OfAllSheetsFollowATextileThatChangesThePlan) {
  Scene scene = hung(4);
  scene.solver.substep = 2e-4;
  scene.sheets.push_back(scene.sheets[0]);
  scene.sheets[1].name = "other";
  scene.sheets[1].origin.z() += 2;
  Simulation simulation(scene);
  for (int k = 0; k < 3; ++k) ASSERT_TRUE(simulation.advance_frame());
  ASSERT_EQ(simulation.plan().step.slow_every, 4);
  ASSERT_FALSE(simulation.set_textile(1, {supple(0.02), 0.02, 0.3}));
  ASSERT_EQ(simulation.plan().step.slow_every, 1);
  ASSERT_TRUE(simulation.advance_frame());

  Simulation restored(scene);
  ASSERT_TRUE(restored.restore(simulation.snapshot()));
  for (Simulation* each : {&simulation, &restored}) {
    ASSERT_FALSE(each->set_textile(0, {supple(2e-5), 0.02, 0.3}));
    for (int k = 0; k < 3; ++k) ASSERT_TRUE(each->advance_frame());
  }
  EXPECT_EQ(hash_of(positions(restored)), hash_of(positions(simulation)));
}

TEST(SlowForces, StandInThePlan) {
  const auto passes = [](int slow_every) {
    Scene scene = hung(slow_every);
    scene.environment.wind = Wind{.velocity = {1, 0, 0}};
    return Simulation(scene).plan().passes;
  };
  using ::testing::Contains;
  EXPECT_THAT(passes(4), Contains("wind, every 4 substeps"));
  EXPECT_THAT(passes(4), Contains(::testing::EndsWith("stencils, every 4 substeps")));
  EXPECT_THAT(passes(1), Contains("wind"));
}

}  // namespace
}  // namespace weft::testing

#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "client/scene_file.h"
#include "core/lattice/lattice.h"
#include "server/convert/convert.h"
#include "tests/client/client_test.h"
#include "tests/support/core/scenes.h"
#include "tests/support/service/process.h"
#include "tests/support/temporary_directory.h"

namespace weft::testing {
namespace {

std::string path_of(const std::string& name) { return WEFT_TEST_DATA_DIR "/finds/" + name; }

Scene find(const std::string& name) {
  const v1::Scene scene = client::read_scene(path_of(name));
  return std::get<Scene>(to_scene(scene, "scene"));
}

// What a particle slides along a great circle of `radius` from its top, v' = g sin - mu (g cos -
// v^2 / R), by the midpoint rule. m
double slide_from_the_top(double radius, double speed, double friction, double seconds) {
  const double g = 9.8, dt = 1e-6;
  double slid = 0, v = speed;
  const auto acceleration = [&](double at, double now) {
    const double angle = at / radius;
    return g * std::sin(angle) - friction * std::max(0.0, g * std::cos(angle) - now * now / radius);
  };
  for (double time = 0; time < seconds; time += dt) {
    const double middle = v + acceleration(slid, v) * dt / 2;
    v += acceleration(slid + v * dt / 2, middle) * dt;
    slid += middle * dt;
  }
  return slid;
}

// Largest kinetic energy of so many seconds, J; what it was when the simulation failed, too.
double most_energy(Simulation& simulation, double seconds) {
  double most = 0;
  while (simulation.time() < seconds && simulation.advance_frame())
    most = std::max(most, simulation.stats().kinetic_energy);
  return most;
}

bool warns(const Simulation& simulation, const std::string& code) {
  const auto& warnings = simulation.plan().warnings;
  return std::any_of(warnings.begin(), warnings.end(),
                     [&](const Warning& warning) { return warning.code == code; });
}

TEST(Finds, AStiffSheetHungWithDefaultDampingStaysCalm) {
  Simulation simulation(find("default_damping_explodes.json"));
  EXPECT_TRUE(warns(simulation, "UNDERDAMPED"));
  EXPECT_LT(most_energy(simulation, 6), 0.2);
  EXPECT_TRUE(simulation.repairs().empty());
}

// What falls is m g h; reading fast modes by their extrapolated velocities adds some per cent.
TEST(Finds, SheetsWithoutAnyDampingGainLittleEnergyAndAreWarnedOf) {
  for (const char* name :
       {"hung_without_damping_gains_energy.json", "squashed_without_damping_explodes.json"}) {
    SCOPED_TRACE(name);
    const Scene scene = find(name);
    Simulation simulation(scene);
    EXPECT_TRUE(warns(simulation, "UNDERDAMPED"));
    const SheetDefinition& sheet = scene.sheets[0];
    const double fall = make_lattice(sheet).mass.sum() * scene.environment.gravity.norm() *
                        (grid_of(sheet).rows - 1) * sheet.spacing();
    const FrameStats start = simulation.stats();
    const double stored = start.kinetic_energy + start.potential_energy;
    while (simulation.time() < 5) {
      ASSERT_TRUE(simulation.advance_frame());
      const FrameStats stats = simulation.stats();
      ASSERT_LT(stats.kinetic_energy + stats.potential_energy,
                stored + 0.1 * std::max(fall, stored))
          << simulation.time();
    }
  }
}

TEST(Finds, AStepThatIsAskedForAgainstTheWarningIsHalvedOnceEnergyComesFromNothing) {
  Scene scene = find("default_damping_explodes.json");
  scene.sheets[0].textile.damping = 2e-4;
  scene.solver.substep = 0.9 * Simulation(scene).plan().step.linear_bound;
  Simulation simulation(scene);
  EXPECT_TRUE(warns(simulation, "UNDERDAMPED"));
  EXPECT_LT(most_energy(simulation, 10), 60);  // 6200 J without
  ASSERT_FALSE(simulation.repairs().empty());
  EXPECT_NE(simulation.repairs()[0].reason.find("energy rose"), std::string::npos);
}

// Of the particles that the middle of the board met, with its front at z = `front`, m: those that
// it has come through.
int behind(const Scene& scene, const Simulation& simulation, double front) {
  const auto& board = std::get<Box>(scene.colliders[0].shape);
  const Matrix3Xd start = start_positions(scene.sheets[0]), now = positions(simulation);
  int met = 0, count = 0;
  for (Eigen::Index i = 0; i < start.cols(); ++i) {
    const Vector3d from = (start.col(i) - board.center).cwiseAbs();
    if (from.x() > 0.8 * board.half_size.x() || from.y() > 0.8 * board.half_size.y()) continue;
    ++met;
    count += now(2, i) < front;
  }
  EXPECT_GT(met, 150);
  return count;
}

TEST(Finds, ABoardThatIsMovedAsFastAsAllowedCarriesTheClothAlong) {
  for (const bool plain : {true, false}) {
    Scene scene = find("swept_board.json");
    scene.solver.plain = plain;
    Simulation simulation(scene);
    Action move;
    move.kind = Action::Kind::kMoveCollider;
    move.name = "board";
    move.target = {0, 0, 0.6};
    move.duration = 0.03;
    ASSERT_FALSE(simulation.act({move}));
    for (int frame = 0; frame < 3; ++frame) ASSERT_TRUE(simulation.advance_frame());
    EXPECT_GE(positions(simulation)(2, 15 * 31 + 15), 0.28);
    EXPECT_EQ(behind(scene, simulation, 0.31), 0);
  }
}

TEST(Finds, ABoardAt100MetresPerSecondDoesNotComeThroughTheCloth) {
  for (const bool plain : {true, false}) {
    Scene scene = find("board_at_100_m_per_s_passes_through.json");
    scene.solver.plain = plain;
    scene.solver.frame_step = 0.006;  // it arrives; later the cloth slides off it
    Simulation simulation(scene);
    ASSERT_TRUE(simulation.advance_frame());
    EXPECT_EQ(behind(scene, simulation, 0.31), 0);
  }
}

TEST(Finds, AFrameThatTakesMinutesIsWatchedAndEndsWithCtrlC) {
  const TemporaryDirectory directory;
  const std::string shown = directory.path("watch.txt");
  Process watch("weft", {"watch", "--embedded", path_of("long_frame.json")}, shown);
  while (read_file(shown).find("frame 1: ") == std::string::npos)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  watch.signal(SIGINT);
  EXPECT_EQ(watch.wait(), 0);
  EXPECT_THAT(read_file(shown), ::testing::HasSubstr(" % computed\n"));
}

TEST(Finds, FrictionOnABallTakesWhatTheNormalForceOfACurvedPathAllows) {
  for (const bool plain : {true, false}) {
    Scene scene = find("friction_on_a_ball.json");
    scene.solver.plain = plain;
    Simulation simulation(scene);
    const auto center = [&] { return Vector3d(positions(simulation).rowwise().mean()); };
    const Vector3d start = center();
    for (int frame = 0; frame < 5; ++frame) ASSERT_TRUE(simulation.advance_frame());
    const Vector3d end = center();
    const double angle = std::atan2(start.cross(end).norm(), start.dot(end));
    const double skin = 1e-4, radius = 0.1 + skin;
    const double expected = slide_from_the_top(radius, 0.9, 0.5, simulation.time());
    EXPECT_NEAR(angle * radius, expected, 1e-5) << plain;
  }
}

}  // namespace
}  // namespace weft::testing

#include <gtest/gtest.h>

#include <cmath>

#include "client/scene_file.h"
#include "server/rpc/convert.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

Scene find(const std::string& name) {
  const v1::Scene scene = client::read_scene(std::string(WEFT_TEST_DATA_DIR "/finds/") + name);
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

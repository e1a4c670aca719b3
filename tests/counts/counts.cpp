// Frames of a scene, for their instructions to be counted: weft-counts CASE.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <string>

#include "core/simulation.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/triangle_meshes.h"

// In place of Highway's, which reads a clock by rdtscp when it is loaded: on processors that hide
// that instruction Callgrind has none.
namespace hwy::platform {
std::uint64_t TimerResolution();
std::uint64_t TimerResolution() { return 1; }
}  // namespace hwy::platform

namespace weft::counts {
namespace {

RawTextile& raw(Scene& scene) { return std::get<RawTextile>(scene.sheets[0].textile.model); }

// A curtain of the paper's textile that swings.
Scene curtain() {
  SheetDefinition sheet = testing::flat_sheet(31, 31);
  sheet.pins = {{{0, 30}, {}}};
  Scene scene = testing::floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  scene.solver.frame_step = 16 * 2e-4;
  scene.solver.substep = 2e-4;
  return scene;
}

Simulation simulation(Scene scene, int frames = 2) {
  Simulation made(std::move(scene));
  for (int frame = 0; frame < frames; ++frame)
    if (!made.advance_frame()) std::abort();
  return made;
}

Simulation plain() { return simulation(curtain()); }

Simulation with_far_collider() {
  Scene scene = curtain();
  scene.colliders = {{"ball", Sphere{{50, 0, 0}, 0.1}, 0.3, {}}};
  return simulation(scene);
}

Simulation with_wind() {
  Scene scene = curtain();
  scene.environment.wind = Wind{};
  return simulation(scene);
}

Simulation without_damping() {
  Scene scene = curtain();
  scene.sheets[0].textile.damping = 0;
  return simulation(scene);
}

Simulation without_bending() {
  Scene scene = curtain();
  raw(scene).bend = 0;
  return simulation(scene);
}

Simulation bending_taken_away() {
  Simulation made = plain();
  Scene scene = made.scene();
  raw(scene).bend = 0;
  if (made.set_textile(0, scene.sheets[0].textile)) std::abort();
  return made;
}

// Looked at for values that are not finite alone.
Simulation without_guard() {
  Scene scene = curtain();
  scene.solver.max_repairs = 0;
  return simulation(scene);
}

// With nothing to tether it to.
Simulation free(std::optional<double> tether_stretch) {
  Scene scene = curtain();
  scene.sheets[0].pins.clear();
  scene.sheets[0].tether_stretch = tether_stretch;
  return simulation(scene);
}
Simulation unpinned() { return free({}); }
Simulation unpinned_with_tethers() { return free(0); }

Simulation with_tethers() {
  Scene scene = curtain();
  scene.sheets[0].tether_stretch = 0;
  return simulation(scene);
}

Simulation asleep() {
  Scene scene = curtain();
  scene.environment.gravity.setZero();
  return simulation(scene, 40);
}

// A curtain of triangles that swings, of cotton.
Scene draped() {
  SheetDefinition sheet;
  sheet.shape = complete(triangle_mesh(testing::scattered(31, 0.01)));
  sheet.textile = {MeasuredTextile{.areal_density = 0.15,
                                   .tensile_warp = 100,
                                   .tensile_weft = 100,
                                   .shear = 10,
                                   .bend_rigidity_warp = 1e-6,
                                   .bend_rigidity_weft = 1e-6},
                   1e-4, 0.3};
  sheet.bending = Isometric{};
  sheet.pins = {{{0, 30}, {}}};
  Scene scene = testing::floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  scene.solver.frame_step = 16 * 2e-5;
  scene.solver.substep = 2e-5;
  scene.solver.max_repairs = 0;  // energies that the guard asks for depend on the motion
  return scene;
}
void take_bending(Scene& scene) {
  auto& textile = std::get<MeasuredTextile>(scene.sheets[0].textile.model);
  textile.bend_rigidity_warp = textile.bend_rigidity_weft = 0;
}

Simulation triangles() { return simulation(draped()); }

Simulation triangles_with_far_collider() {
  Scene scene = draped();
  scene.colliders = {{"ball", Sphere{{50, 0, 0}, 0.1}, 0.3, {}}};
  return simulation(scene);
}

// With cloth contact, and a collider that it does not come near.
Simulation triangles_in_contact(const decltype(Collider::shape)& far) {
  Scene scene = draped();
  scene.cloth_contact = true;
  scene.colliders = {{"far", far, 0.3, {}}};
  return simulation(scene);
}
Simulation triangles_with_far_ball() { return triangles_in_contact(Sphere{{50, 0, 0}, 0.1}); }
Simulation triangles_with_far_box() {
  return triangles_in_contact(Box{{50, 0, 0}, {0.1, 0.1, 0.1}});
}

Simulation triangles_with_wind() {
  Scene scene = draped();
  scene.environment.wind = Wind{};
  return simulation(scene);
}

Simulation triangles_without_damping() {
  Scene scene = draped();
  scene.sheets[0].textile.damping = 0;
  return simulation(scene);
}

Simulation triangles_without_bending() {
  Scene scene = draped();
  take_bending(scene);
  return simulation(scene);
}

Simulation triangles_with_bending_taken_away() {
  Simulation made = triangles();
  Scene scene = made.scene();
  take_bending(scene);
  if (made.set_textile(0, scene.sheets[0].textile)) std::abort();
  return made;
}

}  // namespace

// By name, for the counter.
[[gnu::noinline]] void counted(Simulation& simulation) {
  for (int frame = 0; frame < 4; ++frame)
    if (!simulation.advance_frame()) std::abort();
}

}  // namespace weft::counts

int main(int count, char** arguments) {
  using namespace weft::counts;
  const std::map<std::string, weft::Simulation (*)()> cases = {
      {"plain", plain},
      {"far_collider", with_far_collider},
      {"wind", with_wind},
      {"no_damping", without_damping},
      {"no_bending", without_bending},
      {"bending_taken_away", bending_taken_away},
      {"no_guard", without_guard},
      {"tethers", with_tethers},
      {"unpinned", unpinned},
      {"unpinned_tethers", unpinned_with_tethers},
      {"asleep", asleep},
      {"triangles", triangles},
      {"triangles_far_collider", triangles_with_far_collider},
      {"triangles_far_ball", triangles_with_far_ball},
      {"triangles_far_box", triangles_with_far_box},
      {"triangles_wind", triangles_with_wind},
      {"triangles_no_damping", triangles_without_damping},
      {"triangles_no_bending", triangles_without_bending},
      {"triangles_bending_taken_away", triangles_with_bending_taken_away}};
  const auto found = count == 2 ? cases.find(arguments[1]) : cases.end();
  if (found == cases.end()) {
    std::fputs("weft-counts CASE: none of that name\n", stderr);
    return 2;
  }
  weft::Simulation simulation = found->second();
  counted(simulation);
}

#include "tests/support/core/energy_trial.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/core/scenes.h"

namespace weft::testing {

Scene undisturbed_scene(std::mt19937_64& random) {
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const auto decades = [&](double low, double high) {
    return low * std::pow(high / low, uniform());
  };
  const auto whole = [&](int low, int high) {
    return low + static_cast<int>(uniform() * (high - low + 1));
  };
  SheetDefinition sheet = flat_sheet(whole(2, 12), whole(2, 12), decades(0.005, 0.1));
  const double mass = decades(1e-5, 1e-2);
  const double stretch = mass * std::pow(decades(100, 4000), 2) / 8;  // of 100 to 4000 rad/s
  sheet.textile.model = RawTextile{.particle_mass = mass,
                                   .stretch = stretch,
                                   .shear = stretch * decades(0.01, 1),
                                   .bend = decades(1e-9, 1e-4),
                                   .clamp = stretch * decades(1e-3, 1),
                                   .air_drag = 0};
  sheet.textile.damping = decades(1e-6, 1) * std::sqrt(mass * stretch);
  const int columns = grid_of(sheet).columns, particles = sheet.particle_count();
  const int kind = whole(0, 3);
  if (kind > 0) sheet.pins = {{{0, columns - 1}, {}}};
  if (kind == 3) {
    sheet.pins = {{}};
    for (int c = 0; c < columns; ++c) sheet.pins[0].particles.push_back(c);
  }
  if (kind != 1) {  // crumpled
    Matrix3Xd x = start_positions(sheet);
    Matrix3Xd crumple =
        decades(1e-4, 0.1) * sheet.spacing() * noise(particles, static_cast<unsigned>(random()));
    if (!sheet.pins.empty())
      for (const int i : sheet.pins[0].particles) crumple.col(i).setZero();
    sheet.start_positions = values(x + crumple);
  }
  Scene scene = floating(sheet);
  if (kind > 0) scene.environment.gravity = {0, -9.8, 0};
  scene.solver.precision = uniform() < 0.5 ? Precision::kSingle : Precision::kDouble;
  return scene;
}

EnergyTrial try_energy(const Scene& scene, double seconds) {
  EnergyTrial trial;
  Simulation simulation(scene);
  const auto& warnings = simulation.plan().warnings;
  trial.warned = std::any_of(warnings.begin(), warnings.end(),
                             [](const Warning& each) { return each.code == "UNDERDAMPED"; });
  const SheetDefinition& sheet = scene.sheets[0];
  const double mass =
      std::get<RawTextile>(sheet.textile.model).particle_mass * sheet.particle_count();
  trial.weight = mass * scene.environment.gravity.norm() * sheet.spacing() *
                 (std::max(grid_of(sheet).rows, grid_of(sheet).columns) - 1);
  constexpr int kFrames = 15;
  double least = std::numeric_limits<double>::infinity();
  while (simulation.time() < seconds) {
    double mean = 0, stored = 0;
    for (int frame = 0; frame < kFrames; ++frame) {
      if (!simulation.advance_frame()) {
        trial.repaired = true;
        return trial;
      }
      const FrameStats stats = simulation.stats();
      const double gravity =
          -mass * scene.environment.gravity.dot(positions(simulation).rowwise().mean());
      mean += (stats.kinetic_energy + stats.potential_energy) / kFrames;
      stored += (stats.kinetic_energy + stats.potential_energy - gravity) / kFrames;
    }
    trial.stored = std::max(trial.stored, stored);
    if (simulation.time() < 1.01) continue;
    trial.gain = std::max(trial.gain, mean - least);
    least = std::min(least, mean);
  }
  trial.repaired = !simulation.repairs().empty();
  return trial;
}

}  // namespace weft::testing

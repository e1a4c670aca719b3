#include "core/fingerprint.h"

#include <bit>
#include <random>
#include <vector>

#include "core/simulation.h"

namespace weft {
namespace {

// Uneven, so that every kind of force acts from the first step.
SheetDefinition rough_sheet(const BendingLaw& bending) {
  SheetDefinition sheet;
  sheet.name = "sheet";
  const Grid grid{4, 17, 0.01};
  sheet.shape = grid;
  sheet.textile.model = MeasuredTextile{.areal_density = 0.2,
                                        .tensile_warp = 300,
                                        .tensile_weft = 200,
                                        .shear = 30,
                                        .bend_rigidity_warp = 2e-6,
                                        .bend_rigidity_weft = 1e-6,
                                        .air_drag = 0.1};
  sheet.bending = bending;
  std::minstd_rand random;
  for (int r = 0; r < grid.rows; ++r)
    for (int c = 0; c < grid.columns; ++c)
      for (const double at : {c * 0.0098, 0.0, r * 0.0098})
        sheet.start_positions.push_back(at + 1e-3 * static_cast<double>(random()) / random.max());
  sheet.pins = {{{0}, {}}};
  return sheet;
}

Scene rough_scene(const std::vector<BendingLaw>& laws) {
  Scene scene;
  for (const BendingLaw& law : laws) scene.sheets.push_back(rough_sheet(law));
  scene.colliders.push_back({"sphere", Sphere{{0.1, -0.05, 0.02}, 0.05}, 0.3, {}});
  scene.colliders.push_back({"plane", Plane{}, 0.3, {}});
  scene.environment.wind = {.velocity = {1, 2, 3}, .gust = 0.5, .tangential_drag = 0.1};
  scene.solver.frame_step = 2.5e-4;
  return scene;
}

}  // namespace

std::uint64_t fingerprint() {
  std::uint64_t hash = 0xcbf29ce484222325;  // FNV-1a
  const auto add = [&](double value) {
    hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 0x100000001b3;
  };
  ChoiKo series, exact, segments, optimal, polynomial;
  series.evaluator = Evaluator::kSeries;
  exact.evaluator = Evaluator::kExact;
  segments = {.segments = 60, .fold_clamp = true, .diagonal_bend = false};
  optimal.optimal_breakpoints = true;
  polynomial.evaluator = Evaluator::kPolynomial;
  const Scene single = rough_scene({ChoiKo{}, segments, optimal, polynomial, Isometric{}});
  Scene twofold = rough_scene({ChoiKo{}, Isometric{}}), plain = rough_scene({series, exact});
  twofold.solver.precision = Precision::kDouble;
  for (const Scene& scene : {single, twofold, plain}) {
    Simulation simulation(scene);
    std::vector<double> x(3 * static_cast<std::size_t>(simulation.particle_count()));
    for (int frame = 0; frame < 4; ++frame) {
      if (!simulation.advance_frame()) break;
      simulation.copy_positions(x);
      for (const double value : x) add(value);
    }
  }
  return hash;
}

}  // namespace weft

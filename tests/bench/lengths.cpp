#include "tests/bench/lengths.h"

#include <algorithm>
#include <cstdlib>
#include <random>

#include "tests/support/core/scenes.h"

namespace weft::bench {
namespace {

std::vector<double> make_hung_lengths() {
  SheetDefinition sheet = testing::flat_sheet(31, 31);
  sheet.pins = {{{0, 30}, {}}};
  const Mesh mesh = make_lattice(sheet);
  Scene scene = testing::floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  scene.solver.frame_step = 0.1;
  Simulation simulation(scene);
  std::vector<double> out;
  for (int step = 0; step < kHungSteps; ++step) {
    if (!simulation.advance_frame()) std::abort();
    const Matrix3Xd x = testing::positions(simulation);
    for (const Family& family : mesh.families)
      if (family.bend)
        for (const auto& [i, j] : family.connections)
          out.push_back(std::min(1.0, (x.col(i) - x.col(j)).norm() / family.rest_length));
  }
  return out;
}

}  // namespace

const std::vector<double>& even_lengths() {
  static const std::vector<double> values = [] {
    std::mt19937_64 random(1);
    std::vector<double> out(1024);  // with the results in the first cache
    for (double& r : out) r = static_cast<double>(random() >> 11) * 0x1p-53;
    return out;
  }();
  return values;
}

const std::vector<double>& hung_lengths() {
  static const std::vector<double> values = make_hung_lengths();
  return values;
}

}  // namespace weft::bench

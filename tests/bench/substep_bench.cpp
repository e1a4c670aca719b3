#include <benchmark/benchmark.h>

#include <cstdlib>
#include <string>

#include "tests/support/core/scenes.h"

namespace weft {
namespace {

// Substeps of a sheet of the paper's textile hung by two corners, from when it has begun to fall.
void advance(benchmark::State& state, int rows, Evaluator evaluator) {
  SheetDefinition sheet = testing::flat_sheet(rows, rows);
  sheet.bending = ChoiKo{.evaluator = evaluator};
  sheet.pins = {{{0, rows - 1}, {}}};
  Scene scene = testing::floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  scene.solver.frame_step = 16 * Simulation(scene).plan().step.substep;
  Simulation simulation(scene);
  for (int frame = 0; frame < 20; ++frame)
    if (!simulation.advance_frame()) std::abort();
  for (auto _ : state)
    if (!simulation.advance_frame()) state.SkipWithError("diverged");
  state.SetItemsProcessed(state.iterations() * simulation.plan().step.substeps *
                          simulation.particle_count());
}

const bool added = [] {
  const auto add = [](int rows, Evaluator evaluator, const char* law) {
    const std::string size = std::to_string(rows) + "x" + std::to_string(rows);
    benchmark::RegisterBenchmark(("substep/" + size + "/double/plain/" + law).c_str(),
                                 [=](benchmark::State& state) { advance(state, rows, evaluator); });
  };
  for (const int rows : {31, 101}) {
    add(rows, Evaluator::kLinearized, "LINEARIZED");
    add(rows, Evaluator::kSeries, "SERIES");
    add(rows, Evaluator::kExact, "EXACT");
  }
  return true;
}();

}  // namespace
}  // namespace weft

BENCHMARK_MAIN();

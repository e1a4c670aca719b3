#include <benchmark/benchmark.h>
#include <hwy/targets.h>
#include <malloc.h>

#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/session/idle_threads.h"
#include "tests/support/core/scenes.h"

namespace weft {
namespace {

struct Case {
  int rows = 31;
  Precision precision = Precision::kSingle;
  std::int64_t target = 0;  // of Highway; 0: the plain solver
  bool bare = false;        // neither damping nor compensation
  ChoiKo law{};
  int threads = 1;
};

// Of a frame: what the paper's experiments take in 1/60 s.
constexpr int kSubsteps = 61;

// A sheet of the paper's textile hung by two corners.
Scene scene_of(const Case& given, int rows) {
  SheetDefinition sheet = testing::flat_sheet(rows, rows);
  sheet.bending = given.law;
  sheet.pins = {{{0, rows - 1}, {}}};
  if (given.bare) sheet.textile.damping = 0;
  Scene scene = testing::floating(sheet);
  scene.solver.precision = given.precision;
  scene.solver.plain = given.target == 0;
  scene.solver.compensated = !given.bare;
  scene.environment.gravity = {0, -9.8, 0};
  return scene;
}

// Substeps of the sheet from when it has begun to fall; `kept` is it from one repetition to the
// next.
void advance(benchmark::State& state, const Case& given, std::optional<Simulation>& kept) {
  if (given.target != 0) {
    if ((hwy::SupportedTargets() & given.target) == 0)
      return state.SkipWithError("this processor lacks it");
    hwy::SetSupportedTargetsForTest(given.target);
  }
  if (!kept) {
    // the bound hardly depends on the size, and takes long to find for the largest
    Scene scene = scene_of(given, given.rows);
    scene.solver.frame_step = kSubsteps * Simulation(scene_of(given, 31)).plan().step.substep;
    kept.emplace(std::move(scene));
  }
  Simulation& simulation = *kept;
  Scheduler scheduler(given.threads - 1);
  std::optional<IdleThreads> pool;
  do {
    pool.emplace(scheduler, given.threads);
    for (int frame = 0; frame < (given.rows > 317 ? 1 : 5); ++frame)
      if (!simulation.advance_frame(*pool)) std::abort();
  } while (pool->threads() < given.threads);
  for (auto _ : state)
    if (!simulation.advance_frame(*pool)) state.SkipWithError("diverged");
  state.SetItemsProcessed(state.iterations() * simulation.plan().step.substeps *
                          simulation.particle_count());
  hwy::SetSupportedTargetsForTest(0);
}

// Bytes that a simulation holds when it has made its first frame, and packed.
void hold(benchmark::State& state, int rows) {
  SheetDefinition sheet = testing::flat_sheet(rows, rows);
  sheet.pins = {{{0, rows - 1}, {}}};
  Scene scene = testing::floating(sheet);
  scene.solver.precision = Precision::kSingle;  // as sessions are
  constexpr int kCount = 16;
  if (!Simulation(scene).advance_frame()) std::abort();  // frees what others left to this thread
  for (auto _ : state) {
    std::vector<Simulation> simulations;
    simulations.reserve(kCount);
    const auto used = [] {
      const struct mallinfo2 now = mallinfo2();
      return static_cast<double>(now.uordblks + now.hblkhd);
    };
    const double before = used();
    for (int i = 0; i < kCount; ++i)
      if (!simulations.emplace_back(scene).advance_frame()) std::abort();
    state.counters["bytes"] = (used() - before) / kCount;
    for (Simulation& simulation : simulations) simulation.release_memory();
    state.counters["bytes_packed"] = (used() - before) / kCount;
  }
}

void add(const std::string& name, const Case& given) {
  const auto kept = std::make_shared<std::optional<Simulation>>();
  benchmark::RegisterBenchmark(
      name.c_str(), [given, kept](benchmark::State& state) { advance(state, given, *kept); });
}

const bool added = [] {
  for (const int rows : {31, 101})
    benchmark::RegisterBenchmark(
        ("memory/" + std::to_string(rows) + "x" + std::to_string(rows)).c_str(),
        [rows](benchmark::State& state) { hold(state, rows); })
        ->Iterations(1);
  for (const int rows : {31, 101, 317, 1000}) {
    const std::string size = std::to_string(rows) + "x" + std::to_string(rows);
    for (const auto& [target, name] : {std::pair<std::int64_t, const char*>(HWY_AVX3, "AVX-512"),
                                       std::pair<std::int64_t, const char*>(HWY_AVX2, "AVX2")}) {
      const std::string end = std::string("/") + name + "/1";
      add("substep/" + size + "/float" + end, {rows, Precision::kSingle, target});
      add("substep/" + size + "/double" + end, {rows, Precision::kDouble, target});
      add("substep_bare/" + size + "/float" + end, {rows, Precision::kSingle, target, true});
    }
    add("substep/" + size + "/float/AVX-512/2", {.rows = rows, .target = HWY_AVX3, .threads = 2});
  }
  add("substep/31x31/float/AVX-512/1/OPTIMAL",
      {.target = HWY_AVX3, .law = {.optimal_breakpoints = true}});
  add("substep/31x31/float/AVX2/1/OPTIMAL",
      {.target = HWY_AVX2, .law = {.optimal_breakpoints = true}});
  for (const int rows : {31, 101}) {
    const std::string size = std::to_string(rows) + "x" + std::to_string(rows);
    const auto plain = [&](Evaluator evaluator, const char* law) {
      add("substep/" + size + "/double/plain/1/" + law,
          {rows, Precision::kDouble, 0, false, {.evaluator = evaluator}});
    };
    plain(Evaluator::kLinearized, "LINEARIZED");
    plain(Evaluator::kSeries, "SERIES");
    plain(Evaluator::kExact, "EXACT");
  }
  return true;
}();

}  // namespace
}  // namespace weft

BENCHMARK_MAIN();

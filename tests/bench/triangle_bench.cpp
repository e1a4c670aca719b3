#include <benchmark/benchmark.h>
#include <hwy/targets.h>
#include <malloc.h>

#include <cmath>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/session/idle_threads.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/triangle_meshes.h"

namespace weft {
namespace {

// Which connections a square is cut by; kDelaunay: of any valence.
enum class Kind { kRight, kAlternating, kDelaunay };

struct Case {
  int columns = 100;
  Kind kind = Kind::kDelaunay;
  Precision precision = Precision::kSingle;
  std::int64_t target = HWY_AVX3;  // of Highway; 0: the plain solver
  int threads = 1;
  bool bends = true, damps = true, pushes = true;
};

RestShape shape_of(Kind kind, int columns) {
  const double spacing = 1.0 / (columns - 1);
  if (kind == Kind::kDelaunay) return testing::scattered(columns, spacing);
  return testing::square(kind == Kind::kRight ? Cut::kRight : Cut::kAlternating,
                         1, spacing);
}

// A square metre of cotton hung by two corners.
Scene scene_of(const Case& given) {
  const int n = given.columns;
  SheetDefinition sheet;
  sheet.name = "cloth";
  sheet.shape = complete(testing::triangle_mesh(shape_of(given.kind, n)));
  const double rigidity = given.bends ? 1e-5 : 0;
  sheet.textile.model = MeasuredTextile{.areal_density = 0.15,
                                        .tensile_warp = 1000,
                                        .tensile_weft = 1000,
                                        .shear = 50,
                                        .bend_rigidity_warp = rigidity,
                                        .bend_rigidity_weft = rigidity};
  sheet.textile.damping = given.damps ? kDefaultDamping : 0;
  sheet.bending = Isometric{.resist_compression = given.pushes};
  sheet.pins = {{{0, n - 1}, {}}};
  Scene scene = testing::floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  scene.solver.precision = given.precision;
  scene.solver.plain = given.target == 0;
  return scene;
}

// Substeps of the sheet from when it has begun to fall.
void advance(benchmark::State& state, const Case& given, std::optional<Simulation>& kept) {
  if (given.target != 0) {
    if ((hwy::SupportedTargets() & given.target) == 0)
      return state.SkipWithError("this processor lacks it");
    hwy::SetSupportedTargetsForTest(given.target);
  }
  if (!kept) {
    Scene scene = scene_of(given);
    const double step = Simulation(scene).plan().step.substep;
    scene.solver.substep = step;
    scene.solver.frame_step = 64 * step;
    kept.emplace(std::move(scene));
  }
  Simulation& simulation = *kept;
  Scheduler scheduler(given.threads - 1);
  std::optional<IdleThreads> pool;
  do {
    pool.emplace(scheduler, given.threads);
    for (int frame = 0; frame < 3; ++frame)
      if (!simulation.advance_frame(*pool)) std::abort();
  } while (pool->threads() < given.threads);
  for (auto _ : state)
    if (!simulation.advance_frame(*pool)) state.SkipWithError("diverged");
  state.SetItemsProcessed(state.iterations() * simulation.plan().step.substeps *
                          simulation.particle_count());
  hwy::SetSupportedTargetsForTest(0);
}

// Bytes that a simulation holds when it has made its first frame, and packed; without the mesh
// that it was given, which scenes share.
void hold(benchmark::State& state) {
  const Scene scene = scene_of({});
  if (!Simulation(scene).advance_frame()) std::abort();
  for (auto _ : state) {
    const auto used = [] {
      const struct mallinfo2 now = mallinfo2();
      return static_cast<double>(now.uordblks + now.hblkhd);
    };
    const double before = used();
    Simulation simulation(scene);
    if (!simulation.advance_frame()) std::abort();
    state.counters["bytes_per_particle"] = (used() - before) / simulation.particle_count();
    simulation.release_memory();
    state.counters["bytes_per_particle_packed"] = (used() - before) / simulation.particle_count();
  }
}

void add(const std::string& name, const Case& given) {
  const auto kept = std::make_shared<std::optional<Simulation>>();
  benchmark::RegisterBenchmark(
      name.c_str(), [given, kept](benchmark::State& state) { advance(state, given, *kept); });
}

const bool added = [] {
  benchmark::RegisterBenchmark("triangles_memory/10000", hold)->Iterations(1);
  for (const int columns : {32, 100, 224}) {
    const std::string size = "/" + std::to_string(columns * columns);
    for (const auto& [kind, name] :
         {std::pair(Kind::kRight, "/right"), std::pair(Kind::kAlternating, "/alternating"),
          std::pair(Kind::kDelaunay, "/Delaunay")}) {
      const std::string begin = "triangles" + size + name;
      add(begin + "/float/AVX-512/1", {columns, kind});
      add(begin + "/float/AVX2/1", {columns, kind, Precision::kSingle, HWY_AVX2});
      add(begin + "/double/AVX-512/1", {columns, kind, Precision::kDouble});
      if (columns == 224)
        add(begin + "/float/AVX-512/2", {.columns = columns, .kind = kind, .threads = 2});
    }
  }
  const std::string begin = "triangles/10000/Delaunay/float/AVX-512/1/";
  add(begin + "no_bending", {.bends = false});
  add(begin + "no_damping", {.damps = false});
  add(begin + "membrane", {.bends = false, .damps = false});
  add(begin + "shortened_at_no_cost", {.pushes = false});
  add("triangles/1024/Delaunay/double/plain/1",
      {.columns = 32, .precision = Precision::kDouble, .target = 0});
  return true;
}();

}  // namespace
}  // namespace weft

// Cloth on bodies and on cloth: what contact costs, and what passes through all the same.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <iostream>

#include "core/simulation.h"
#include "tests/reports/contact_scenes.h"
#include "tests/reports/report.h"

namespace weft::reports {
namespace {

using Cells = std::vector<std::string>;

double processor_time() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

Scene without_contact(Scene scene) {
  scene.cloth_contact = false;
  scene.colliders.clear();
  return scene;
}

struct Cost {
  double with = 0, without = 0, longest = 0;  // s of processor time; of a frame
  std::int64_t cuts = 0;
};

// Frame by frame in turns, so that both meet the same machine.
Cost cost_of(const Scene& scene, int frames) {
  Simulation one(scene), other(without_contact(scene));
  Cost cost;
  for (int frame = 0; frame < frames; ++frame) {
    const double begin = processor_time();
    if (!one.advance_frame()) throw std::runtime_error(one.failure());
    const double middle = processor_time();
    if (!other.advance_frame()) throw std::runtime_error(other.failure());
    cost.with += middle - begin;
    cost.longest = std::max(cost.longest, middle - begin);
    cost.without += processor_time() - middle;
    cost.cuts += *one.stats().cloth_cuts;
  }
  return cost;
}

void costs(Page& page, bool large) {
  page.text("## What it costs");
  page.text(
      "Processor time of a run with contact over that of the same run without any, nor bodies, "
      "frame by frame in turns.");
  std::vector<Cells> rows;
  const int n = large ? 101 : 71, layers = large ? 51 : 31;
  const std::vector<std::tuple<std::string, Scene, double>> cases = {
      {"hangs and swings, triangles", hung(n, false), 1.0},
      {"hangs and swings, lattice", hung(n, true), 1.0},
      {"falls onto a ball", draped(n), 1.0},
      {"ten sheets fall onto a ball", stacked(layers), large ? 1.0 : 0.6}};
  for (const auto& [says, scene, seconds] : cases) {
    const Cost cost = cost_of(scene, static_cast<int>(60 * seconds));
    int particles = 0;
    for (const SheetDefinition& sheet : scene.sheets) particles += sheet.particle_count();
    rows.push_back({says, std::to_string(particles), fmt::format("{:.2f}", cost.without),
                    fmt::format("{:.2f}", cost.with / cost.without),
                    fmt::format("{:.2f}", 1e3 * cost.longest), std::to_string(cost.cuts)});
    page.row({"cost", says, number(cost.without), number(cost.with), number(cost.longest),
              std::to_string(cost.cuts)});
    std::cerr << fmt::format("{}\n", fmt::join(rows.back(), ", "));
  }
  page.table({"scene", "particles", "without, s", "with / without", "longest frame, ms", "cuts"},
             rows);
}

void cuts(Page& page, bool large) {
  page.text("## What passes through");
  page.text(
      "Edges that pass through triangles, counted exactly at the end of every frame, without those "
      "that share a particle.");
  std::vector<Cells> rows;
  for (const ContactScene& each : contact_scenes(large)) {
    Simulation simulation(each.scene);
    std::int64_t most = 0, last = 0;
    int frames = 0, with_cuts = 0;
    const double begin = processor_time();
    double longest = 0, passed = 0;
    for (; simulation.time() < each.seconds; ++frames) {
      const double before = processor_time();
      if (!simulation.advance_frame()) break;
      const double took = processor_time() - before;
      longest = std::max(longest, took);
      passed += took;
      last = *simulation.stats().cloth_cuts;
      most = std::max(most, last);
      with_cuts += last > 0 ? 1 : 0;
    }
    rows.push_back({each.says, std::to_string(simulation.particle_count()), std::to_string(frames),
                    std::to_string(with_cuts), std::to_string(most), std::to_string(last),
                    fmt::format("{:.1f}", passed), fmt::format("{:.0f}", 1e3 * longest),
                    std::to_string(simulation.repairs().size()) + simulation.failure()});
    page.row({"cuts", each.name, std::to_string(frames), std::to_string(most), number(passed),
              number(longest)});
    std::cerr << fmt::format("{} ({:.1f} s)\n", fmt::join(rows.back(), ", "),
                             processor_time() - begin);
  }
  page.table({"scene", "particles", "frames", "with cuts", "most", "at the end", "processor s",
              "longest frame, ms", "repairs"},
             rows);
}

}  // namespace

void contact(const std::filesystem::path& folder, const std::string& commit, bool large) {
  Page page(folder, {"what", "scene", "a", "b", "c", "d"});
  page.text("# Contact");
  page.text(fmt::format("Made by `./dev bench contact` on {}.", machine(commit)));
  costs(page, large);
  cuts(page, large);
  page.write();
}

}  // namespace weft::reports

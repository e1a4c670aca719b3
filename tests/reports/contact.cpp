// Cloth on bodies and on cloth: what contact costs, and what passes through all the same.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <iostream>
#include <numeric>

#include "core/simulation.h"
#include "tests/reports/blender.h"
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

struct Watched {
  std::vector<double> frames;      // processor time of each, s
  std::vector<std::int64_t> cuts;  // at the end of each
  std::string repairs;             // how many, and why it failed

  double time() const { return std::accumulate(frames.begin(), frames.end(), 0.0); }
  double longest() const { return std::ranges::max(frames); }
};

Watched watch(const ContactScene& each) {
  Simulation simulation(each.scene);
  Watched watched;
  while (simulation.time() < each.seconds) {
    const double begin = processor_time();
    if (!simulation.advance_frame()) break;
    watched.frames.push_back(processor_time() - begin);
    watched.cuts.push_back(*simulation.stats().cloth_cuts);
  }
  watched.repairs = std::to_string(simulation.repairs().size()) + simulation.failure();
  return watched;
}

Cells cells_of(const std::vector<std::int64_t>& cuts) {
  const auto clean = std::count(cuts.begin(), cuts.end(), 0);
  return {std::to_string(static_cast<std::ptrdiff_t>(cuts.size()) - clean),
          std::to_string(std::ranges::max(cuts)), std::to_string(cuts.back())};
}

void cuts(Page& page, bool large) {
  const auto blender = blender_version();
  std::vector<Cells> rows, beside;
  for (const ContactScene& each : contact_scenes(large)) {
    const Watched ours = watch(each);
    const Cells found = cells_of(ours.cuts);
    int particles = 0;
    for (const SheetDefinition& sheet : each.scene.sheets) particles += sheet.particle_count();
    rows.push_back({each.says, std::to_string(particles), std::to_string(ours.cuts.size()),
                    found[0], found[1], found[2], fmt::format("{:.1f}", ours.time()),
                    fmt::format("{:.0f}", 1e3 * ours.longest()), ours.repairs});
    page.row(
        {"cuts", each.name, rows.back()[2], found[1], number(ours.time()), number(ours.longest())});
    std::cerr << fmt::format("{}\n", fmt::join(rows.back(), ", "));
    if (!blender) continue;
    const BlenderRun theirs = run_blender(each.scene, static_cast<int>(ours.frames.size()));
    const double time = std::accumulate(theirs.frames.begin(), theirs.frames.end(), 0.0);
    const Cells cut = cells_of(theirs.cuts);
    beside.push_back({each.says, fmt::format("{:.1f}", ours.time()), fmt::format("{:.1f}", time),
                      fmt::format("{:.2f}", ours.time() / time), found[0], cut[0], found[1],
                      cut[1]});
    page.row({"blender", each.name, rows.back()[2], cut[1], number(time),
              number(std::ranges::max(theirs.frames))});
    std::cerr << fmt::format("{}\n", fmt::join(beside.back(), ", "));
  }
  page.text("## What passes through");
  page.text(
      "Edges that pass through triangles, counted exactly at the end of every frame, without those "
      "that share a particle.");
  page.table({"scene", "particles", "frames", "with cuts", "most", "at the end", "processor s",
              "longest frame, ms", "repairs"},
             rows);
  if (!blender) return;
  page.text("## Beside " + *blender);
  page.text(
      "The same meshes, bodies, pins, density, stretch and shear with its self-collision, one "
      "thread each; bending is about as stiff, all else is left as it comes (five steps a frame). "
      "Processor time, and cuts counted as above.");
  page.table({"scene", "Weft, s", "Blender, s", "Weft / Blender", "frames with cuts", "Blender's",
              "most cuts", "Blender's"},
             beside);
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

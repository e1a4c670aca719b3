// Cloth on bodies and on cloth: what contact costs, and what passes through all the same.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <iostream>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>

#include "core/simulation.h"
#include "tests/reports/blender.h"
#include "tests/reports/contact_scenes.h"
#include "tests/reports/picture.h"
#include "tests/reports/report.h"
#include "tests/support/core/bodies.h"
#include "tests/support/core/scenes.h"

namespace weft::reports {
namespace {

using Cells = std::vector<std::string>;

constexpr double kBall = 0.15;  // radius of those in scenes, m

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
      {"the same in air (drag 2/s), triangles", hung(n, false, 2), 1.0},
      {"the same in air (drag 2/s), lattice", hung(n, true, 2), 1.0},
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

// Draws it where there is a picture to draw.
Watched watch(const ContactScene& each, Accuracy accuracy,
              const std::optional<std::filesystem::path>& picture = {}) {
  Scene scene = each.scene;
  scene.solver = default_settings(accuracy);
  Simulation simulation(scene);
  Watched watched;
  while (simulation.time() < each.seconds) {
    const double begin = processor_time();
    if (!simulation.advance_frame()) break;
    watched.frames.push_back(processor_time() - begin);
    watched.cuts.push_back(*simulation.stats().cloth_cuts);
    if (picture && simulation.frame() == std::lround(each.shown / scene.solver.frame_step))
      draw(simulation, *picture);
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
  page.text("## What passes through");
  std::vector<Cells> rows, beside;
  for (const ContactScene& each : contact_scenes(large)) {
    int particles = 0;
    for (const SheetDefinition& sheet : each.scene.sheets) particles += sheet.particle_count();
    std::map<Accuracy, double> times;
    std::int64_t most = 0;
    int frames = 0;
    for (const auto& [says, accuracy] :
         {std::pair("STANDARD", Accuracy::kStandard), {"DRAFT", Accuracy::kDraft}}) {
      const bool is_shown = accuracy == Accuracy::kStandard;
      const Watched ours =
          watch(each, accuracy,
                is_shown ? std::optional(page.picture(
                               each.name, fmt::format("{}, after {} s", each.says, each.shown)))
                         : std::nullopt);
      const Cells found = cells_of(ours.cuts);
      frames = static_cast<int>(ours.cuts.size());
      times[accuracy] = ours.time();
      most = std::max(most, std::ranges::max(ours.cuts));
      rows.push_back({each.says, says, std::to_string(particles), std::to_string(frames), found[0],
                      found[1], found[2], fmt::format("{:.1f}", ours.time()),
                      fmt::format("{:.0f}", 1e3 * ours.longest()), ours.repairs});
      page.row({is_shown ? "cuts" : "cuts of DRAFT", each.name, rows.back()[3], found[1],
                number(ours.time()), number(ours.longest())});
      std::cerr << fmt::format("{}\n", fmt::join(rows.back(), ", "));
    }
    if (!blender) continue;
    const BlenderRun theirs = run_blender(each.scene, frames);
    const double time = std::accumulate(theirs.frames.begin(), theirs.frames.end(), 0.0);
    const double standard = times[Accuracy::kStandard], draft = times[Accuracy::kDraft];
    const Cells cut = cells_of(theirs.cuts);
    beside.push_back({each.says, fmt::format("{:.1f}", standard), fmt::format("{:.1f}", draft),
                      fmt::format("{:.1f}", time), fmt::format("{:.2f}", standard / time),
                      fmt::format("{:.2f}", draft / time), std::to_string(most), cut[0], cut[1]});
    page.row({"blender", each.name, std::to_string(frames), cut[1], number(time),
              number(std::ranges::max(theirs.frames))});
    std::cerr << fmt::format("{}\n", fmt::join(beside.back(), ", "));
  }
  page.text(
      "Edges that pass through triangles, counted exactly at the end of every frame, without those "
      "that share a particle.");
  page.table({"scene", "accuracy", "particles", "frames", "with cuts", "most", "at the end",
              "processor s", "longest frame, ms", "repairs"},
             rows);
  if (!blender) return;
  page.text("## Beside " + *blender);
  page.text(
      "The same meshes, bodies, pins, density, stretch and shear with its self-collision, one "
      "thread each; bending is about as stiff, all else is left as it comes (five steps a frame). "
      "Processor time, and cuts counted as above; DRAFT is as much softer as it states.");
  page.table({"scene", "STANDARD, s", "DRAFT, s", "Blender, s", "STANDARD / Blender",
              "DRAFT / Blender", "most cuts of both", "Blender's frames with cuts", "most"},
             beside);
}

// How far what lies on a ball is from where the exact sphere would hold it.
void ball_error(Page& page) {
  Scene scene = draped(31);
  scene.sheets[0].textile.damping_ratio = 0.1;
  const double skin = scene.sheets[0].skin_or_default();
  const Scene beside = [&] {
    Scene exact = scene;
    exact.colliders[0].shape = Sphere{Vector3d::Zero(), kBall};
    return exact;
  }();
  std::vector<Cells> rows;
  for (const auto& [says, each] : {std::pair("5 120 triangles", scene), {"the sphere", beside}}) {
    Simulation simulation(each);
    while (simulation.time() < 8 && !simulation.at_rest())
      if (!simulation.advance_frame()) throw std::runtime_error(simulation.failure());
    const VectorXd pressures = simulation.pressures(0);
    const Matrix3Xd x = testing::positions(simulation);
    double most = 0;
    int touching = 0;
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
      if (pressures[i] <= 0) continue;
      ++touching;
      most = std::max(most, std::abs(x.col(i).norm() - kBall - skin));
    }
    rows.push_back({says, simulation.at_rest() ? fmt::format("{:.2f}", simulation.time()) : "-",
                    std::to_string(touching), fmt::format("{:.3f}", 1e3 * most)});
    page.row({"ball", says, number(simulation.time()), std::to_string(touching), number(most)});
  }
  page.text(
      "Wool of 0.3 m at rest on a ball of 0.15 m: the farthest that a particle which presses on it "
      "is from where the sphere holds it.");
  page.table({"given as", "at rest after, s", "particles that press", "farthest, mm"}, rows);
}

// The angle from which on a patch slides down an incline of triangles.
void friction_angle(Page& page) {
  constexpr double kDegree = std::numbers::pi / 180;
  std::vector<Cells> rows;
  for (const double friction : {0.1, 0.3, 0.6, 1.0}) {
    const double exact = std::atan(friction);
    double holds = exact - kDegree, slides = exact + kDegree;
    while (slides - holds > 0.005 * kDegree) {
      const double angle = (holds + slides) / 2;
      const Quaterniond turn(Eigen::AngleAxisd(-angle, Vector3d::UnitZ()));
      const Collider incline = testing::solid(testing::box_mesh({0.5, 0.1, 0.1}, turn), friction);
      constexpr double kSlides = 2e-5;  // m in 0.4 s: at 0.002 degrees more
      (testing::slide_on(incline, turn, {0.013, 0.101, 0.007}, 0.4) > kSlides ? slides : holds) =
          angle;
    }
    rows.push_back({fmt::format("{}", friction), fmt::format("{:.3f}", exact / kDegree),
                    fmt::format("{:.3f}", slides / kDegree)});
    page.row({"friction", rows.back()[0], number(exact), number(slides)});
  }
  page.text("An incline of triangles: where a patch begins to slide, beside atan(mu).");
  page.table({"mu", "atan(mu), degrees", "slides from, degrees"}, rows);
}

// Contact that acts once in several steps, beside that which acts in each.
void window_error(Page& page) {
  constexpr double kInEachStep = 0.01;  // a safety for which windows are shorter than a step
  constexpr double kShorter = 4;        // steps, so that the shortest window shown has some
  const std::vector<ContactScene> all = contact_scenes(false);
  const Scene& twisted = std::ranges::find(all, "twist", &ContactScene::name)->scene;
  const auto run = [](Scene scene, int frames, double safety) {
    scene.solver.substep = Simulation(scene).plan().step.substep / kShorter;
    scene.solver.safety = safety;
    Simulation simulation(scene);
    const double begin = processor_time();
    while (simulation.frame() < frames)
      if (!simulation.advance_frame()) throw std::runtime_error(simulation.failure());
    return std::pair{testing::positions(simulation), processor_time() - begin};
  };
  const std::vector<std::tuple<std::string, Scene, int>> cases = {
      {"the tube, when it has met itself", twisted, 18},
      {"0.3 m fall onto a ball", draped(31), 10}};
  std::vector<Cells> rows;
  for (const auto& [says, scene, frames] : cases) {
    const auto [truth, slowest] = run(scene, frames, kInEachStep);
    for (const double safety : {0.9, 0.45, 0.225}) {
      const auto [x, time] = run(scene, frames, safety);
      const double error = std::sqrt((x - truth).colwise().squaredNorm().mean());
      rows.push_back({says, fmt::format("{}", safety), fmt::format("{:.4f}", 1e3 * error),
                      fmt::format("{:.2f}", time / slowest)});
      page.row({"window", says, rows.back()[1], number(error), number(time), number(slowest)});
    }
  }
  page.text(
      "Contact acts once in a window of steps, 0.25 ms or less, and shorter with `safety`. How far "
      "particles are from where contact in each step leads them, and in how much of its time; in "
      "a quarter of the planned step.");
  page.table({"scene", "safety", "RMS, mm", "time"}, rows);
}

}  // namespace

void contact(const std::filesystem::path& folder, const std::string& commit, bool large) {
  Page page(folder, {"what", "scene", "a", "b", "c", "d"});
  page.text("# Contact");
  page.text(fmt::format("Made by `./dev bench contact` on {}.", machine(commit)));
  costs(page, large);
  page.text("## Against what is exact");
  ball_error(page);
  friction_angle(page);
  window_error(page);
  cuts(page, large);
  page.write();
}

}  // namespace weft::reports

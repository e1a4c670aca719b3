// Tethers: what hung cloth costs, and how far from stiff cloth it is, with and without them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <optional>

#include "core/lattice/shown.h"
#include "tests/reports/report.h"
#include "tests/reports/trial.h"
#include "tests/support/core/scenes.h"

namespace weft::reports {
namespace {

using Cells = std::vector<std::string>;

// A square of 1 m x 1 m, 0.2 kg in equal parts, level at the start, by raw constants; a drag of 2
// 1/s, a rigidity of 1e-5 N m, a k_d of 2e-4 kg/s.
SheetDefinition raw_square(int side, double stiffness) {
  const double spacing = 1.0 / (side - 1), mass = 0.2 / (side * side);
  SheetDefinition sheet = testing::flat_sheet(side, side, spacing);
  sheet.textile = {RawTextile{.particle_mass = mass,
                              .stretch = stiffness,
                              .shear = stiffness,
                              .bend = 2.0 / 3 * 1e-5 * spacing,
                              .clamp = {},
                              .air_drag = 2 * mass},
                   2e-4, 0.3};
  sheet.bending = Isometric{};
  return sheet;
}

// By two corners.
Scene hung(int side, double stiffness) {
  Scene scene;
  scene.sheets = {raw_square(side, stiffness)};
  scene.sheets[0].pins = {{{0, side - 1}, {}}};
  return scene;
}

// By two corners, of cloth that shears as easily as wool does.
Scene sheared(int side, double stiffness) {
  Scene scene = hung(side, stiffness);
  std::get<RawTextile>(scene.sheets[0].textile.model).shear = 50;
  return scene;
}

// By an edge, over a rail 20 cm away, from which most of it hangs.
Scene over_rail(int side, double stiffness) {
  Scene scene = hung(side, stiffness);
  scene.sheets[0].pins[0].particles.clear();
  for (int i = 0; i < side; ++i) scene.sheets[0].pins[0].particles.push_back(i);
  scene.sheets[0].skin = 0.002;
  scene.colliders = {{"rail", Capsule{{-0.1, -0.024, 0.2}, {1.1, -0.024, 0.2}, 0.02}, 0.1, {}}};
  return scene;
}

// Positions at times, and what a simulated second takes of a core, s.
struct Course {
  Matrix3Xd half, whole, rest;  // after 0.5 s, 1 s, and where it lies still or after 10 s
  std::int64_t substeps = 0;    // of a frame
  double time = 0;
  double seconds = 0;  // until it lay still, simulated
};

Course follow(const Scene& scene) {
  constexpr int kMost = 10 * 60;
  Course made;
  Simulation simulation(scene);
  made.substeps = simulation.plan().step.substeps;
  const std::clock_t start = std::clock();
  for (int frame = 1; frame <= kMost && !simulation.at_rest(); ++frame) {
    if (!simulation.advance_frame()) throw std::runtime_error(simulation.failure());
    if (frame == 30) made.half = testing::positions(simulation);
    if (frame != 60) continue;
    made.whole = testing::positions(simulation);
    made.time = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  }
  made.rest = testing::positions(simulation);
  made.seconds = simulation.time();
  return made;
}

// In double, at half the planned step.
Course truth_of(Scene scene) {
  scene.solver = default_settings(Accuracy::kStandard);
  scene.solver.precision = Precision::kDouble;
  scene.solver.safety /= 2;
  return follow(scene);
}

using MakeScene = Scene (*)(int side, double stiffness);

// Of which frames show `side` x `side` particles.
Course follow_interpolated(MakeScene make, int side, int every, double stiffness) {
  Scene scene = make((side - 1) / every + 1, stiffness);
  scene.sheets[0].tether_stretch = 0;
  Course made = follow(scene);
  const Grid from = std::get<Grid>(scene.sheets[0].shape), to{side, side, from.spacing / every};
  for (Matrix3Xd* x : {&made.half, &made.whole, &made.rest}) *x = resample(*x, from, to);
  return made;
}

// By tethers alone or not, and of which rows and columns are simulated.
struct Way {
  bool tethered = false;
  int every = 1;
};

void compare(Page& page, const std::string& name, MakeScene make, int side, double stiffest,
             const std::vector<double>& stiffnesses) {
  const int few = side > 100 ? 4 : 2;
  const Course truth = truth_of(make(side, stiffest));
  std::vector<Cells> rows;
  for (const double stiffness : stiffnesses)
    for (const auto [tethered, every] : {Way{false, 1}, Way{true, 1}, Way{true, few}}) {
      Scene scene = make(side, stiffness);
      if (tethered) scene.sheets[0].tether_stretch = 0;
      const Course made =
          every == 1 ? follow(scene) : follow_interpolated(make, side, every, stiffness);
      const std::array errors = {rms(made.half - truth.half), rms(made.whole - truth.whole),
                                 rms(made.rest - truth.rest)};
      Cells cells = {number(stiffness), tethered ? "yes" : "no", std::to_string(every),
                     std::to_string(made.substeps), fmt::format("{:.1f}", 1e3 * made.time)};
      for (const double error : errors) cells.push_back(fmt::format("{:.1f}", 1e3 * error));
      cells.push_back(made.seconds < 9.99 ? fmt::format("{:.1f}", made.seconds) : "-");
      rows.push_back(cells);
      page.row({name, std::to_string(side), number(stiffness), tethered ? "1" : "0",
                std::to_string(every), std::to_string(made.substeps), number(made.time),
                number(errors[0]), number(errors[1]), number(errors[2])});
    }
  page.text(
      fmt::format("{0} x {0} particles. Truth: k = {1} N/m, in double, at half the planned step.",
                  side, stiffest));
  page.table({"k N/m", "tethers", "simulated every", "substeps a frame", "ms per s", "mm at 0.5 s",
              "mm at 1 s", "mm at rest", "still after s"},
             rows);
}

}  // namespace

void tethers(const std::filesystem::path& folder, const std::string& commit, bool large) {
  Page page(folder,
            {"scene", "side", "k_n_per_m", "tethers", "simulated_every", "substeps_per_frame",
             "core_s_per_simulated_s", "rms_0.5_s_m", "rms_1_s_m", "rms_rest_m"});
  page.text("# Tethers");
  page.text(
      "Made by `./dev bench tethers` on " + machine(commit) +
      ". Cloth that hangs is held in length by its textile, which takes stiff connections and so "
      "short steps; or by tethers (`tether_stretch` of 0), and the textile may be soft. RMS "
      "distances from stiff cloth, and what the first simulated second takes of a core, in single "
      "precision at the planned step. With `simulated_every` 2 or 4 fewer rows and columns are "
      "simulated, and errors are those of all particles that frames show. A square of 1 m x 1 m, "
      "0.2 kg, level at the start; raw "
      "constants with k = k_s = k_shear, ISOMETRIC with B = 1e-5 N m, k_d = 2e-4 kg/s, drag 2 "
      "1/s.");
  const std::vector<double> stiffnesses = {50, 100, 200, 400, 1000, 2000, 8000};
  page.text("## Hung by two corners");
  compare(page, "hung", hung, 31, 128'000, stiffnesses);
  if (large) compare(page, "hung", hung, 101, 8'000, {50, 100, 200, 400, 1000, 2000});
  page.text("## Of cloth that shears");
  page.text(
      "The same with k_shear = 50 N/m throughout, as wool has it. Such cloth gets longer along its "
      "bias without stretching a thread; tethers do not let it (TETHERS_STIFFEN), and stiffer "
      "threads do not take that error away.");
  compare(page, "sheared", sheared, 31, 32'000, stiffnesses);
  page.text("## Over a rail");
  page.text(
      "Held by an edge, it lies over a rail of 4 cm, 20 cm away, and hangs from it. Tethers are "
      "straight: they are slack where the cloth goes around. Cells of 67 mm let the rail through "
      "(COLLIDER_THIN).");
  compare(page, "rail", over_rail, 31, 32'000, stiffnesses);
  page.write();
}

}  // namespace weft::reports

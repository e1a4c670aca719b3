// Rest: what it takes to come to it in time, and by relaxation, and how far apart the two are.
#include <fmt/format.h>

#include <ctime>
#include <optional>
#include <stdexcept>

#include "tests/reports/report.h"
#include "tests/reports/trial.h"
#include "tests/support/core/scenes.h"

namespace weft::reports {
namespace {

// A square of 1 m x 1 m and 0.2 kg, level, held by two corners and, in length, by tethers.
Scene tethered(int side) {
  const double spacing = 1.0 / (side - 1), mass = 0.2 / (side * side);
  SheetDefinition sheet = testing::flat_sheet(side, side, spacing);
  sheet.textile = {RawTextile{.particle_mass = mass,
                              .stretch = 100,
                              .shear = 100,
                              .bend = 2.0 / 3 * 1e-5 * spacing,
                              .clamp = {},
                              .air_drag = 2 * mass},
                   2e-4, 0.3};
  sheet.bending = Isometric{};
  sheet.tether_stretch = 0;
  sheet.pins = {{{0, side - 1}, {}}};
  Scene scene;
  scene.sheets = {std::move(sheet)};
  return scene;
}

struct Rest {
  Matrix3Xd x;
  std::int64_t frames = 0;
  double time = 0;  // simulated, s
  double core = 0;  // s
  std::optional<double> residual;
  bool reached = false;
};

Rest follow(Simulation& simulation) {
  constexpr std::int64_t kMost = 20 * 60;
  Rest made;
  const std::int64_t begin = simulation.frame();
  const std::clock_t start = std::clock();
  while (!simulation.at_rest() && simulation.frame() - begin < kMost)
    if (!simulation.advance_frame()) throw std::runtime_error(simulation.failure());
  made.core = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  made.frames = simulation.frame() - begin;
  made.time = static_cast<double>(made.frames) * simulation.scene().solver.frame_step;
  made.x = testing::positions(simulation);
  made.residual = simulation.residual();
  made.reached = simulation.at_rest();
  return made;
}

// Something is done to it that changes nothing: it moves on.
void wake(Simulation& simulation) {
  const int middle = simulation.particle_count() / 2;
  if (simulation.act({{.kind = Action::Kind::kGrab, .particle = middle},
                      {.kind = Action::Kind::kRelease, .particle = middle}}))
    throw std::runtime_error("a grip changed the step");
}

std::string seconds(double value) { return fmt::format("{:.3g}", value); }
std::string millimetres(double value) { return fmt::format("{:.2f}", 1e3 * value); }

// in_time: as it moves, too.
void compare(Page& page, std::vector<std::vector<std::string>>& rows, const std::string& name,
             int side, const Scene& scene, bool in_time) {
  std::optional<Rest> moved;
  if (in_time) {
    Simulation simulation(scene);
    moved = follow(simulation);
  }
  Simulation relaxed(scene);
  if (relaxed.act({{.kind = Action::Kind::kRelax}})) throw std::runtime_error("not relaxed");
  const Rest direct = follow(relaxed);
  wake(relaxed);
  const double on = rms(follow(relaxed).x - direct.x);
  const double apart = moved ? rms(direct.x - moved->x) : 0;
  const double residual = direct.residual.value_or(0);
  rows.push_back({name, std::to_string(side), moved ? fmt::format("{:.1f}", moved->time) : "",
                  moved ? (moved->reached ? "" : "> ") + seconds(moved->core) : "",
                  std::to_string(direct.frames), seconds(direct.core),
                  fmt::format("{:.1e}", residual), millimetres(on),
                  moved ? millimetres(apart) : ""});
  page.row({name, std::to_string(side), moved ? number(moved->time) : "",
            moved ? number(moved->core) : "", std::to_string(direct.frames), number(direct.core),
            number(residual), number(on), moved ? number(apart) : ""});
}

}  // namespace

void rest(const std::filesystem::path& folder, const std::string& commit, bool large) {
  Page page(folder, {"scene", "side", "moved_s", "moved_core_s", "relaxed_frames", "relaxed_core_s",
                     "residual", "moves_on_rms_m", "apart_rms_m"});
  page.text("# Rest");
  page.text(
      "Made by `./dev bench rest` on " + machine(commit) +
      ". Squares of 1 m x 1 m that start level, until they are at rest: as they move in time, and "
      "by "
      "relaxation (`weft run --until-rest --relax`), which starts on fewer rows and columns. "
      "Seconds are of one core, without planning. The residual is what forces are left over the "
      "weights, RMS. *Moves on* is how far a sheet that has relaxed goes when it moves again until "
      "it is at rest, *apart* how far from it the rest lies that motion came to, both RMS. Where "
      "friction holds or folds may lie in several ways there are many rests: a large *apart* "
      "beside "
      "a small *moves on* is another one.");
  std::vector<std::vector<std::string>> rows;
  constexpr int kLarge = 317;  // takes hours as it moves in time
  std::vector<int> sides = {31, 101};
  if (large) sides.push_back(kLarge);
  for (const int side : sides) {
    compare(page, rows, "hang, with tethers", side, tethered(side), true);
    for (const char* name : {"hang", "sphere", "box"}) {
      Scene scene = make_case(name, side).scene;
      scene.sheets[0].bending = Isometric{};
      compare(page, rows, name, side, scene, true);
    }
  }
  if (!large) compare(page, rows, "hang, with tethers", kLarge, tethered(kLarge), false);
  page.table({"scene", "side", "moved s", "core s", "relaxed frames", "core s", "residual",
              "moves on mm", "apart mm"},
             rows);
  page.text(
      "*hang, with tethers*: 0.2 kg, k = k_s = k_shear = 100 N/m, ISOMETRIC with B = 1e-5 N m, "
      "held in "
      "length by `tether_stretch` of 0. The others are of tropical wool, ISOMETRIC: hung by two "
      "corners, on a ball, on a box.");
  page.write();
}

}  // namespace weft::reports

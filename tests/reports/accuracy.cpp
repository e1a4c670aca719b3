// Work and precision: wall time against the error of positions at a fixed time.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include "tests/reports/report.h"
#include "tests/support/core/scenes.h"

namespace weft::reports {
namespace {

using testing::flat_sheet;

struct Case {
  std::string name;
  Scene scene;
  double time;  // at which positions are compared, s
};

// The paper's textile on 0.5 m, with its damping and a drag that a sheet of cloth has.
SheetDefinition cloth(int side) {
  SheetDefinition sheet = flat_sheet(side, side, 0.5 / (side - 1));
  auto& raw = std::get<RawTextile>(sheet.textile.model);
  raw.particle_mass = 0.1 / (side * side);
  raw.stretch = raw.shear = 400;
  raw.bend = 2e-6 * 15 / (side - 1);
  raw.air_drag = 2e-5 * 225 / (side * side);
  return sheet;
}

Scene scene_of(const SheetDefinition& sheet, double time) {
  Scene scene;
  scene.sheets = {sheet};
  scene.environment.gravity = {0, -9.8, 0};
  scene.solver.frame_step = time;
  scene.solver.max_repairs = 0;
  return scene;
}

std::vector<Case> cases(int side) {
  std::vector<Case> out;
  const auto add = [&](const std::string& name, const Scene& scene) {
    out.push_back({name, scene, scene.solver.frame_step});
  };
  SheetDefinition hung = cloth(side);
  hung.pins = {{{0, side - 1}, {}}};
  add("hang", scene_of(hung, 0.25));

  // squashed to nine tenths and bent: it buckles
  SheetDefinition squashed = cloth(side);
  squashed.bending = ChoiKo{};
  Matrix3Xd x = start_positions(squashed);
  for (auto column : x.colwise()) {
    column.y() = 0.02 * std::sin(2 * M_PI * column.x()) * std::cos(2 * M_PI * column.z());
    column.x() *= 0.9;
  }
  squashed.start_positions = testing::values(x);
  Scene buckling = scene_of(squashed, 0.1);
  buckling.environment.gravity.setZero();
  add("buckle", buckling);

  // taut from the start, so that no connection switches: the smooth scene
  SheetDefinition taut = cloth(side);
  Matrix3Xd stretched = testing::stretched(taut, 0.05);
  for (auto column : stretched.colwise())
    column.y() = 0.02 * std::sin(2 * M_PI * column.x()) * std::sin(2 * M_PI * column.z());
  taut.start_positions = testing::values(stretched);
  Pin rim;
  for (int r = 0; r < side; ++r)
    for (int c = 0; c < side; ++c)
      if (r == 0 || c == 0 || r == side - 1 || c == side - 1) rim.particles.push_back(r * side + c);
  taut.pins = {rim};
  add("taut", scene_of(taut, 0.1));

  SheetDefinition falling = cloth(side);
  falling.origin = {-0.25, 0.16, -0.25};
  Scene sphere = scene_of(falling, 0.25);
  sphere.colliders = {{"sphere", Sphere{{0, 0, 0}, 0.15}, 0.3, {}}};
  add("sphere", sphere);
  return out;
}

struct Result {
  Matrix3Xd x;
  double energy = 0, wall = 0, substep = 0;
  bool good = false;
};

Result run(Scene scene, double step_share) {
  const double bound = Simulation(scene).plan().step.linear_bound;
  const double limit = bound > 0 ? bound : 1e-4;
  scene.solver.substep = step_share * limit;
  scene.solver.allow_unstable = true;
  Result result;
  Simulation simulation(scene);
  const auto begin = std::chrono::steady_clock::now();
  result.good = simulation.advance_frame();
  result.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  result.x = testing::positions(simulation);
  const FrameStats stats = simulation.stats();
  result.energy = stats.kinetic_energy + stats.potential_energy;
  result.substep = simulation.plan().step.substep;
  return result;
}

// A setting and how far it is from the truth.
struct Point {
  std::string scene, evaluator, integrator, precision;
  int side = 0;
  double share = 0, wall = 0, rms = 0, largest = 0, energy = 0, substep = 0;
};

double rms_of(const Matrix3Xd& difference) {
  return std::sqrt(difference.squaredNorm() / static_cast<double>(difference.cols()));
}

// The exact evaluator, one connection after the other; by Runge and Kutta where nothing is touched,
// else by Verlet at a fine step. Good to about `error`.
std::pair<Result, double> truth_of(const Case& given) {
  Scene scene = given.scene;
  scene.solver.plain = true;
  scene.solver.precision = Precision::kDouble;
  scene.sheets[0].bending = ChoiKo{.evaluator = Evaluator::kExact};
  const bool contact = !scene.colliders.empty();
  if (!contact) scene.solver.integrator = IntegratorKind::kRk4;
  const double share = contact ? 1.0 / 32 : 1.0 / 16;
  const Result coarse = run(scene, 2 * share), fine = run(scene, share);
  return {fine, rms_of(fine.x - coarse.x)};
}

std::string evaluator_name(const ChoiKo& law) {
  switch (law.evaluator) {
    case Evaluator::kSeries:
      return "series";
    case Evaluator::kExact:
      return "exact";
    case Evaluator::kPolynomial:
      return fmt::format("polynomial {}", law.degree);
    case Evaluator::kLinearized:
      break;
  }
  return fmt::format("{} segments", law.segments);
}

const std::map<IntegratorKind, std::string> kIntegrators = {{IntegratorKind::kVerlet, "Verlet"},
                                                            {IntegratorKind::kEuler, "Euler"},
                                                            {IntegratorKind::kMidpoint, "midpoint"},
                                                            {IntegratorKind::kRk4, "RK4"}};

class Report {
 public:
  Report(const std::filesystem::path& folder, const std::string& commit)
      : page_(folder,
              {"scene", "particles", "evaluator", "integrator", "precision", "substep_s",
               "share_of_bound", "wall_s", "rms_error_m", "largest_error_m", "energy_error_j"}) {
    page_.text("# Wall time against error");
    page_.text(
        "Made by `./dev bench accuracy` on " + machine(commit) +
        ". Errors are of positions after a fixed time, against a run by the exact evaluator, "
        "one connection after the other, by Runge and Kutta's method at 1/16 of its linear bound "
        "(where the sheet touches something, by Verlet at 1/32); how far that run is from one at "
        "twice its step stands beside it. Taut: no connection switches. Hang, buckle and "
        "sphere: connections go slack, and contact is of first order.");
  }

  void scene(const Case& given, int side) {
    const auto [truth_found, truth_error] = truth_of(given);
    const Result& truth = truth_found;
    std::vector<Point> points;
    const auto measure = [&](const ChoiKo& law, IntegratorKind kind, Precision precision,
                             double share, bool plain = false) {
      Scene scene = given.scene;
      scene.sheets[0].bending = law;
      scene.solver.integrator = kind;
      scene.solver.precision = precision;
      scene.solver.plain = plain;
      const Result result = run(scene, share);
      if (!result.good) return;
      const Matrix3Xd off = result.x - truth.x;
      const bool single = precision == Precision::kSingle && kind == IntegratorKind::kVerlet &&
                          !plain && law.evaluator != Evaluator::kSeries &&
                          law.evaluator != Evaluator::kExact;
      points.push_back({given.name, evaluator_name(law), kIntegrators.at(kind),
                        single ? "single" : "double", side, share, result.wall, rms_of(off),
                        off.colwise().norm().maxCoeff(), std::abs(result.energy - truth.energy),
                        result.substep});
    };
    const auto verlet = IntegratorKind::kVerlet;
    for (const int segments : {2, 5, 8, 16, 32, 60, 128, 256, 1024})
      measure(ChoiKo{.segments = segments}, verlet, Precision::kSingle, 0.9);
    measure({.evaluator = Evaluator::kPolynomial, .degree = 8}, verlet, Precision::kSingle, 0.9);
    measure({.evaluator = Evaluator::kSeries}, verlet, Precision::kDouble, 0.9);
    measure({.evaluator = Evaluator::kExact}, verlet, Precision::kDouble, 0.9);
    const std::size_t evaluators = points.size();
    for (const double share : {0.9, 0.45, 0.225, 0.1125}) {
      for (const auto precision : {Precision::kSingle, Precision::kDouble})
        measure(ChoiKo{.segments = 1024}, verlet, precision, share);
      measure(ChoiKo{}, verlet, Precision::kSingle, share);
      measure(ChoiKo{}, IntegratorKind::kRk4, Precision::kDouble, share);
      measure(ChoiKo{}, IntegratorKind::kMidpoint, Precision::kDouble, share);
    }
    for (const double share : {0.1, 0.02})
      measure(ChoiKo{}, IntegratorKind::kEuler, Precision::kDouble, share);
    write(given, side, truth_error, points, evaluators);
  }

  void finish() { page_.write(); }

 private:
  void write(const Case& given, int side, double truth_error, const std::vector<Point>& points,
             std::size_t evaluators) {
    page_.text(fmt::format("## {}, {} x {} particles, after {} s", given.name, side, side,
                           number(given.time)));
    for (const Point& p : points)
      page_.row({p.scene, std::to_string(p.side * p.side), p.evaluator, p.integrator, p.precision,
                 number(p.substep), number(p.share), number(p.wall), number(p.rms),
                 number(p.largest), number(p.energy)});

    page_.text(fmt::format("The truth is good to {} m RMS. Evaluators at 0.9 of the bound:",
                           number(truth_error)));
    std::vector<std::vector<std::string>> rows;
    for (std::size_t k = 0; k < evaluators; ++k)
      rows.push_back({points[k].evaluator, points[k].precision, number(1e3 * points[k].wall),
                      number(points[k].rms), number(points[k].largest), number(points[k].energy)});
    page_.table({"evaluator", "precision", "wall ms", "RMS m", "largest m", "energy J"}, rows);
    page_.text(
        fmt::format("Order fitted over 0.9 to 0.11 of the bound (Verlet, 1024 segments, "
                    "double): **{}**. No other setting is both faster and closer:",
                    number(order_of(points))));
    rows.clear();
    for (const Point& p : best(points))
      rows.push_back({p.evaluator, p.integrator, p.precision, number(p.share), number(1e3 * p.wall),
                      number(p.rms)});
    page_.table({"evaluator", "integrator", "precision", "share of bound", "wall ms", "RMS m"},
                rows);

    client::Plot plot{fmt::format("{}, {} x {}", given.name, side, side),
                      "log10 of wall time in s",
                      "log10 of RMS error in m",
                      {},
                      true,
                      false};
    std::map<std::string, client::Series> lines;
    for (std::size_t k = evaluators; k < points.size(); ++k) {
      const Point& p = points[k];
      const std::string name = fmt::format("{}, {}, {}", p.integrator, p.evaluator, p.precision);
      lines[name].name = name;
      lines[name].points.emplace_back(std::log10(p.wall), std::log10(p.rms));
    }
    for (const auto& [name, line] : lines) plot.series.push_back(line);
    page_.plot(fmt::format("{}-{}", given.name, side), plot);
  }

  static std::vector<Point> best(std::vector<Point> points) {
    std::sort(points.begin(), points.end(),
              [](const Point& a, const Point& b) { return a.wall < b.wall; });
    std::vector<Point> out;
    for (const Point& p : points)
      if (out.empty() || p.rms < out.back().rms) out.push_back(p);
    return out;
  }

  // Slope of log error over log step, by least squares.
  static double order_of(const std::vector<Point>& points) {
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (const Point& p : points) {
      if (p.evaluator != "1024 segments" || p.precision != "double" || p.integrator != "Verlet")
        continue;
      const double x = std::log(p.substep), y = std::log(p.rms);
      ++n, sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    return (n * sxy - sx * sy) / (n * sxx - sx * sx);
  }

  Page page_;
};

}  // namespace

void accuracy(const std::filesystem::path& folder, const std::string& commit, bool large) {
  Report report(folder, commit);
  for (const int side : large ? std::vector{16, 31, 61} : std::vector{16})
    for (const Case& given : cases(side)) report.scene(given, side);
  report.finish();
}

}  // namespace weft::reports

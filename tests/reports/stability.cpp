// Stability: the step that is predicted, the one that a disturbed sheet really bears.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <random>

#include "tests/reports/report.h"
#include "tests/support/core/energy_trial.h"
#include "tests/support/core/scenes.h"

namespace weft::reports {
namespace {

using testing::flat_sheet;

// A sheet of 7 x 7 particles stretched by 2 % in its frame: every connection stays taut.
SheetDefinition taut_sheet(int side = 7) {
  SheetDefinition sheet = flat_sheet(side, side);
  Pin rim;
  for (int r = 0; r < side; ++r)
    for (int c = 0; c < side; ++c)
      if (r == 0 || c == 0 || r == side - 1 || c == side - 1) rim.particles.push_back(r * side + c);
  sheet.pins = {rim};
  sheet.start_positions = testing::values(testing::stretched(sheet, 0.02));
  return sheet;
}

SheetDefinition crumpled_sheet() {
  SheetDefinition sheet = flat_sheet(8, 8);
  sheet.start_positions =
      testing::values(start_positions(sheet) + 0.05 * sheet.spacing() * testing::noise(64, 3));
  return sheet;
}

RawTextile& raw_of(SheetDefinition& sheet) { return std::get<RawTextile>(sheet.textile.model); }

Scene scene_of(const SheetDefinition& sheet) {
  Scene scene = testing::floating(sheet);
  scene.solver.max_repairs = 0;
  scene.solver.allow_unstable = true;
  return scene;
}

// Whether a disturbance of 1e-6 spacings stays below 1e-3 of them for 10 000 steps.
bool survives(SheetDefinition sheet, double dt) {
  constexpr int kFrames = 10, kSteps = 1000;
  const double h = sheet.spacing();
  const Matrix3Xd rest = start_positions(sheet);
  Matrix3Xd disturbed = rest + 1e-6 * h * testing::noise(sheet.particle_count());
  for (const int i : sheet.pins[0].particles) disturbed.col(i) = rest.col(i);
  sheet.start_positions = testing::values(disturbed);
  Scene scene = scene_of(sheet);
  scene.solver.frame_step = kSteps * dt;
  scene.solver.substep = dt;
  Simulation simulation(scene);
  for (int frame = 0; frame < kFrames; ++frame)
    if (!simulation.advance_frame() ||
        !((testing::positions(simulation) - rest).cwiseAbs().maxCoeff() < 1e-3 * h))
      return false;
  return true;
}

double measured_bound(const SheetDefinition& sheet, const StepPlan& plan) {
  double stable = 0.5 * plan.linear_bound, unstable = 2 * plan.estimated_bound;
  if (!survives(sheet, stable)) return 0;
  while (unstable / stable > 1.005) {
    const double middle = std::sqrt(stable * unstable);
    (survives(sheet, middle) ? stable : unstable) = middle;
  }
  return std::sqrt(stable * unstable);
}

class Report {
 public:
  Report(const std::filesystem::path& folder, const std::string& commit)
      : page_(folder, {"map", "value", "linear_bound_s", "estimate_s", "measured_s",
                       "measured_over_bound", "measured_over_estimate", "damping_ratio"}) {
    page_.text("# Stable steps: predicted and measured");
    page_.text(
        "Made by `./dev bench stability` on " + machine(commit) +
        ". A 7 x 7 sheet of the paper's textile (1 g, k = 2000 N/m, k_d = 2e-4 kg/s, "
        "k_b = 1e-5 N m^2), stretched by 2 % in its frame and disturbed by 1e-6 of its "
        "spacing. Measured: the longest step with which the disturbance stays below 1e-3 for "
        "10 000 steps, within 0.5 %. The linear bound holds for every shape; the estimate is "
        "that of this one.");
  }

  void map(const std::string& name, const std::string& title,
           const std::vector<std::pair<double, SheetDefinition>>& sheets) {
    page_.text("## " + title);
    std::vector<std::vector<std::string>> rows;
    Plot plot{title, name, "step s", {}, true, false, true};
    plot.series = {{"linear bound", {}}, {"estimate", {}}, {"measured", {}}};
    for (const auto& [value, sheet] : sheets) {
      const StepPlan plan = Simulation(scene_of(sheet)).plan().step;
      const double measured = measured_bound(sheet, plan);
      const std::vector<std::string> cells = {
          number(value),
          number(plan.linear_bound),
          number(plan.estimated_bound),
          number(measured),
          fmt::format("{:.3f}", measured / plan.linear_bound),
          fmt::format("{:.3f}", measured / plan.estimated_bound),
          number(plan.damping_ratio)};
      rows.push_back(cells);
      std::vector<std::string> line = cells;
      line.insert(line.begin(), name);
      page_.row(line);
      ratios_.push_back(measured / plan.linear_bound);
      closeness_.push_back(measured / plan.estimated_bound);
      plot.series[0].points.emplace_back(value, plan.linear_bound);
      plot.series[1].points.emplace_back(value, plan.estimated_bound);
      plot.series[2].points.emplace_back(value, measured);
    }
    constexpr std::size_t kMostRows = 40;  // the rest is in the CSV file
    rows.resize(std::min(rows.size(), kMostRows));
    for (auto& series : plot.series)
      series.points.resize(std::min(series.points.size(), kMostRows));
    page_.table({name, "linear bound s", "estimate s", "measured s", "measured / bound",
                 "measured / estimate", "damping ratio"},
                rows);
    page_.plot(name, plot);
  }

  void note(const std::string& text) { page_.text(text); }

  // What energy crumpled sheets are left with, over a value and the step as a share of the bound.
  void free_sheets(const std::string& name,
                   const std::vector<std::pair<double, SheetDefinition>>& sheets) {
    constexpr std::array kShares = {0.1, 0.25, 0.5, 0.9, 1.0, 1.2, 1.5, 2.0, 3.0};
    std::vector<std::string> names = {name};
    for (const double share : kShares) names.push_back(number(share));
    std::vector<std::vector<std::string>> rows;
    for (const auto& [value, sheet] : sheets) {
      std::vector<std::string>& row = rows.emplace_back(1, number(value));
      for (const double share : kShares) {
        const std::optional<double> left = energy_left(sheet, share);
        row.push_back(left ? fmt::format("{:.3f}", *left) : "broken");
        if (share == SolverSettings().safety && sheet.textile.damping > 0)
          most_energy_left_ = std::max(most_energy_left_, left.value_or(HUGE_VAL));
      }
    }
    page_.table(names, rows);
  }

  // Whether random scenes that nothing disturbs gain energy, by the damping ratio of their stiffest
  // mode. set: what they are computed with.
  template <class F>
  void undisturbed(const std::string& title, int scenes, const F& set) {
    struct Decade {
      int scenes = 0, longer = 0, rarely = 0, warned = 0, repaired = 0, silent = 0;
      double most_gain = 0;  // of those that nobody was told of, as a share of what was stored
    };
    std::map<int, Decade> decades;
    std::mt19937_64 generator(1);
    int silent = 0;
    for (int k = 0; k < scenes; ++k) {
      Scene scene = testing::undisturbed_scene(generator);
      set(scene);
      const testing::EnergyTrial trial = testing::try_energy(scene, 10);
      const Plan plan = Simulation(scene).plan();
      Decade& decade = decades[static_cast<int>(std::floor(std::log10(plan.dampings[0].ratio)))];
      ++decade.scenes;
      decade.longer += plan.step.unsheared_bound > plan.step.linear_bound;
      decade.rarely += plan.step.slow_every > 1;
      decade.warned += trial.warned;
      decade.repaired += trial.repaired;
      decade.silent += trial.silent_gain();
      silent += trial.silent_gain();
      if (!trial.warned && !trial.repaired && trial.stored > 0)
        decade.most_gain = std::max(decade.most_gain, trial.gain / trial.stored);
    }
    page_.text("## " + title);
    page_.text(fmt::format(
        "{} random scenes, 10 s each: sheets of 2 to 12 particles a side, any stiffness, hung or "
        "crumpled and free, with a damping over six decades, at the step that is planned. Longer: "
        "that was more than one for every shape allows. Rarely: slow forces do not act in each "
        "substep. Warned: "
        "UNDERDAMPED, before the run. Repaired: the guard halved the step. Gain: the largest rise "
        "of energy over what was stored, of those that nobody was told of. Gained more than 5 % "
        "and 1e-6 m g h in silence: {}.",
        scenes, silent));
    std::vector<std::vector<std::string>> rows;
    for (const auto& [power, decade] : decades)
      rows.push_back({fmt::format("1e{} to 1e{}", power, power + 1), std::to_string(decade.scenes),
                      std::to_string(decade.longer), std::to_string(decade.rarely),
                      std::to_string(decade.warned), std::to_string(decade.repaired),
                      fmt::format("{:.1f} %", 100 * decade.most_gain),
                      std::to_string(decade.silent)});
    page_.table(
        {"damping ratio", "scenes", "longer", "rarely", "warned", "repaired", "gain", "in silence"},
        rows);
  }

  // The paper's third experiment: 0.1 s with k_b of 0.1 and 0.2, 0.05 s with 0.3.
  void paper_claim() {
    page_.text("## The paper's claim of 0.1 s");
    page_.text(
        "Experiment 3 names a step of 0.1 s for k_b = 0.1 and 0.2 and of 0.05 s for 0.3, with "
        "particles of 1 g. Linear bounds in SI, s, on its 31 x 31 sheet of 1 m; bend "
        "connections alone but for the last column:");
    struct Column {
      std::string name;
      double clamp, clamp_per_bend, stretch;
      ChoiKo law;
    };
    const ChoiKo folded{.segments = 2, .fold_clamp = true};
    const std::vector<Column> columns = {{"c_b = 1e-3 N/m", 1e-3, 0, 0, {}},
                                         {"c_b = 0.01 k_b / m^3", 0, 0.01, 0, {}},
                                         {"c_b = 2000", 2000, 0, 0, {}},
                                         {"c_b = 1e7, 2 segments, folded", 1e7, 0, 0, folded},
                                         {"c_b = k_s = 2000", 2000, 0, 2000, {}}};
    std::vector<std::string> names = {"k_b N m^2"};
    for (const Column& column : columns) names.push_back(column.name);
    std::vector<std::vector<std::string>> rows;
    for (const double bend : {0.1, 0.2, 0.3}) {
      std::vector<std::string> row = {number(bend)};
      for (const Column& column : columns) {
        SheetDefinition sheet = flat_sheet(31, 31);
        sheet.bending = column.law;
        raw_of(sheet) = RawTextile{.particle_mass = 1e-3,
                                   .stretch = column.stretch,
                                   .shear = column.stretch,
                                   .bend = bend,
                                   .clamp = column.clamp + column.clamp_per_bend * bend,
                                   .air_drag = 0};
        row.push_back(number(Simulation(scene_of(sheet)).plan().step.linear_bound));
      }
      rows.push_back(row);
    }
    page_.table(names, rows);
    page_.text(
        "With a given c_b the clamp has the steepest slope, and the bound does not depend on k_b, "
        "folded or not. A larger k_b takes a shorter step where c_b grows with it. Any stretch "
        "stiffness of cloth takes steps far below 0.1 s.");
  }

  void finish() {
    const auto [low, high] = std::minmax_element(ratios_.begin(), ratios_.end());
    const auto [near, far] = std::minmax_element(closeness_.begin(), closeness_.end());
    page_.text("## In all");
    page_.text(
        fmt::format("{} sheets: the measured step is {:.3f} to {:.3f} times the linear bound "
                    "and {:.3f} to {:.3f} times the estimate.",
                    ratios_.size(), *low, *high, *near, *far));
    page_.text(
        fmt::format("At {} of the bound, the default, a damped free sheet is left with {:.3f} of "
                    "its energy at most.",
                    SolverSettings().safety, most_energy_left_));
    page_.write();
  }

 private:
  // After 1 s, over that at the start; none where a frame is not finite.
  static std::optional<double> energy_left(const SheetDefinition& sheet, double share) {
    Scene scene = scene_of(sheet);
    scene.solver.frame_step = 1;
    scene.solver.substep = share * Simulation(scene).plan().step.linear_bound;
    Simulation simulation(scene);
    const auto energy = [&] {
      const FrameStats stats = simulation.stats();
      return stats.kinetic_energy + stats.potential_energy;
    };
    const double before = energy();
    if (!simulation.advance_frame()) return std::nullopt;
    const double left = energy() / before;
    return std::isfinite(left) ? std::optional(left) : std::nullopt;
  }

  Page page_;
  std::vector<double> ratios_, closeness_;
  double most_energy_left_ = 0;
};

std::vector<double> powers(double low, double high, int count) {
  std::vector<double> out;
  for (int k = 0; k < count; ++k) out.push_back(low * std::pow(high / low, k / (count - 1.0)));
  return out;
}

}  // namespace

void stability(const std::filesystem::path& folder, const std::string& commit, bool large) {
  Report report(folder, commit);
  const int count = large ? 25 : 7;
  const auto over = [&](const std::string& name, const std::string& title,
                        const std::vector<double>& values, const auto& change) {
    std::vector<std::pair<double, SheetDefinition>> sheets;
    for (const double value : values) {
      SheetDefinition sheet = taut_sheet();
      change(sheet, value);
      sheets.emplace_back(value, sheet);
    }
    report.map(name, title, sheets);
  };
  report.note(
      "On a taut sheet no bend connection is shortened: k_b and segments move the bound at most.");
  over("k_b", "Bending stiffness", powers(1e-7, 1e-1, count),
       [](SheetDefinition& sheet, double value) { raw_of(sheet).bend = value; });
  over("k_s", "Stretch stiffness", powers(1, 1e6, count), [](SheetDefinition& sheet, double value) {
    raw_of(sheet).clamp = raw_of(sheet).stretch;
    raw_of(sheet).stretch = raw_of(sheet).shear = value;
  });
  over("segments", "Segments of the bending curve", {2, 5, 8, 16, 32, 128, 1024},
       [](SheetDefinition& sheet, double value) {
         sheet.bending = ChoiKo{.segments = static_cast<int>(value)};
       });
  over("k_d", "Damping", powers(1e-6, 10, count),
       [](SheetDefinition& sheet, double value) { sheet.textile.damping = value; });
  over("mass", "Mass of a particle", powers(1e-6, 1, count),
       [](SheetDefinition& sheet, double value) { raw_of(sheet).particle_mass = value; });

  std::vector<std::pair<double, SheetDefinition>> resolutions, random;
  for (const int side : {4, 7, 13, 25}) resolutions.emplace_back(side, taut_sheet(side));
  report.map("particles-a-side", "Resolution", resolutions);

  std::mt19937_64 generator(1);
  const auto decades = [&](double low, double high) {
    return low * std::pow(high / low, static_cast<double>(generator() >> 11) * 0x1p-53);
  };
  for (int k = 0; k < (large ? 2000 : 40); ++k) {
    SheetDefinition sheet = taut_sheet();
    raw_of(sheet) = RawTextile{.particle_mass = decades(1e-6, 1),
                               .stretch = decades(1, 1e5),
                               .shear = decades(1, 1e5),
                               .bend = decades(1e-8, 1e-2),
                               .clamp = decades(1, 1e5),
                               .air_drag = 0};
    // up to critical damping of its stiffest mode
    sheet.textile.damping =
        decades(1e-4, 0.3) * std::sqrt(raw_of(sheet).particle_mass * raw_of(sheet).stretch);
    random.emplace_back(k + 1, sheet);
  }
  report.map("random", "Random textiles", random);

  report.note("## Free sheets");
  report.note(
      "A free 8 x 8 sheet of the same textile, crumpled by 5 % of its spacing, without gravity: "
      "its "
      "energy after 1 s over that at the start, with steps from a tenth of the linear bound to "
      "three "
      "times the bound. Above 1 a run has gained energy; broken is no longer finite. Connections "
      "that switch on and off pump energy, also below the bound, where damping is too small.");
  const auto over_free = [&](const std::string& name, const std::vector<double>& values,
                             const auto& change) {
    std::vector<std::pair<double, SheetDefinition>> sheets;
    for (const double value : values) {
      SheetDefinition sheet = crumpled_sheet();
      change(sheet, value);
      sheets.emplace_back(value, sheet);
    }
    report.free_sheets(name, sheets);
  };
  over_free("k_d kg/s", {0, 2e-6, 2e-5, 2e-4, 2e-3},
            [](SheetDefinition& sheet, double value) { sheet.textile.damping = value; });
  over_free("k_b N m^2", powers(1e-7, 1e-1, 7),
            [](SheetDefinition& sheet, double value) { raw_of(sheet).bend = value; });
  over_free("k_s N/m", powers(1, 1e6, 7), [](SheetDefinition& sheet, double value) {
    raw_of(sheet).clamp = raw_of(sheet).stretch = raw_of(sheet).shear = value;
  });
  over_free("segments", {2, 5, 8, 16, 32, 128, 1024}, [](SheetDefinition& sheet, double value) {
    sheet.bending = ChoiKo{.segments = static_cast<int>(value)};
  });
  const int scenes = large ? 2000 : 200;
  report.undisturbed("Energy from nothing", scenes, [](Scene&) {});
  report.undisturbed("The same with steps for unsheared shapes", scenes,
                     [](Scene& scene) { scene.solver.step_bound = StepBound::kUnsheared; });
  report.undisturbed("The same, and with velocities of half a step ago", scenes, [](Scene& scene) {
    scene.solver.step_bound = StepBound::kUnsheared;
    scene.solver.integrator = IntegratorKind::kLaggedVerlet;
  });
  for (const int every : {1, 16})
    report.undisturbed(every == 1 ? "The same of ISOMETRIC"
                                  : "The same of ISOMETRIC, slow forces in one of 16 substeps",
                       scenes, [&](Scene& scene) {
                         scene.sheets[0].bending = Isometric{};
                         scene.solver.step_bound = StepBound::kUnsheared;
                         scene.solver.integrator = IntegratorKind::kLaggedVerlet;
                         scene.solver.slow_forces_every = every;
                       });
  report.paper_claim();
  report.finish();
}

}  // namespace weft::reports

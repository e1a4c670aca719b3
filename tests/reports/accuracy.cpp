// Accuracy: what a simulated second costs, and how far from the truth it ends.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "tests/reports/accuracy_trials.h"
#include "tests/reports/measurements.h"
#include "tests/reports/report.h"

namespace weft::reports {
namespace {

using Cells = std::vector<std::string>;

std::string order_text(const Measured& measured, const Setting& like) {
  const double order = order_of(measured, like);
  return std::isfinite(order) ? fmt::format("{:.2f}", order) : "-";
}

class AccuracyPage {
 public:
  AccuracyPage(const std::filesystem::path& folder, const std::string& commit)
      : page_(folder, {"scene", "side", "evaluator", "integrator", "precision", "solver",
                       "substep_s", "planned_over_substep", "core_s_per_simulated_s", "rms_error_m",
                       "largest_error_m", "energy_error_j"}) {
    page_.text("# Time against error");
    page_.text(
        "Made by `./dev bench accuracy` on " + machine(commit) +
        ". How much of one core's time a simulated second takes, and how far positions and energy "
        "then are from the truth, for every evaluator of the bending function, integrator, "
        "precision and several steps.");
  }

  void add(const Measured& measured) {
    for (const Point& p : measured.points)
      page_.row({measured.given.name, std::to_string(measured.given.side),
                 evaluator_name(p.setting.law), integrator_name(p.setting.integrator),
                 precision_name(p.setting), p.setting.plain ? "one by one" : "kernels",
                 number(p.substep), std::to_string(p.setting.finer), number(p.time), number(p.rms),
                 number(p.largest), number(p.energy)});
    if (measured.given.smooth)
      smooth_ = measured;
    else if (measured.given.triangles)
      triangles_.push_back(measured);
    else
      all_.push_back(measured);
  }

  void write() {
    in_short();
    scenes();
    defaults();
    accuracies();
    precision();
    segments();
    speed();
    orders();
    integrators();
    best();
    resolution();
    interpolation(page_);
    slow_forces(page_);
    less_damping(page_);
    triangles();
    model();
    page_.write();
  }

 private:
  // A range of what the cases come to.
  class Range {
   public:
    void add(double value) {
      low_ = std::min(low_, value);
      high_ = std::max(high_, value);
    }
    std::string text(double unit = 1) const {
      const auto number = [&](double value) {
        return value < 1000 ? fmt::format("{:.3g}", value) : fmt::format("{:.0f}", value);
      };
      return number(low_ / unit) + " to " + number(high_ / unit);
    }
    double high() const { return high_; }

   private:
    double low_ = std::numeric_limits<double>::infinity(), high_ = 0;
  };

  // Errors of the finest runs by Runge-Kutta where nothing is touched, m.
  Range nearest_by_runge_kutta() const {
    Range nearest;
    for (const Measured& m : all_) {
      if (!m.given.scene.colliders.empty()) continue;
      double error = std::numeric_limits<double>::infinity();
      for (const Point& p : m.points)
        if (p.finite && p.setting.integrator == IntegratorKind::kRk4)
          error = std::min(error, p.rms);
      nearest.add(error);
    }
    return nearest;
  }

  void in_short() {
    Range error, farthest, cost, mesh, share, single, exact, folded, free, touching;
    for (std::size_t k = 0; k < all_.size(); ++k) {
      const Measured& m = all_[k];
      const Point& ours = m.defaults();
      error.add(ours.rms);
      farthest.add(ours.largest);
      cost.add(ours.time);
      if (const auto moved = mesh_distance(k)) {
        mesh.add(rms(*moved));
        share.add(rms(*moved) / ours.rms);
      }
      exact.add(
          ours.rms /
          m.find({{.evaluator = Evaluator::kExact}, kVerlet, Precision::kDouble, 1, true})->rms);
      (m.given.scene.colliders.empty() ? free : touching)
          .add(order_of(m, {kFinePolynomial, kVerlet, Precision::kDouble, 1, !m.kernels()}));
      const ChoiKo paper{.segments = 2, .fold_clamp = true};
      Setting like = ours.setting;
      like.law = paper;
      folded.add(m.find(like)->rms);
      if (m.kernels()) single.add(ours.rms / m.find({.precision = Precision::kDouble})->rms);
    }
    page_.text(fmt::format(
        "- The defaults (Verlet, 32 segments, single precision, the planned step; slow forces in "
        "each substep, as everywhere here unless it says otherwise) end {} mm from the truth "
        "(RMS), no particle farther than {} mm. A simulated second takes {} s of a core.\n"
        "- The mesh changes positions by {} mm, {} times as much: what a shorter step, more "
        "segments or double precision gain is not seen beside that.\n"
        "- Error in single precision: {} times that in double; by 32 segments: {} times that by "
        "the exact function.\n"
        "- Two segments that sample the clamped function, as the paper seems to draw them, are {} "
        "mm off.\n"
        "- Verlet's error goes with the step to the power of {:.2f} in a taut sheet, with damping "
        "and drag; of {} where connections switch, of {} where bodies are touched. With a tenth of "
        "the damping no setting converges (below).",
        error.text(1e-3), fmt::format("{:.2g}", 1e3 * farthest.high()), cost.text(),
        mesh.text(1e-3), share.text(), single.text(), exact.text(), folded.text(1e-3),
        order_of(*smooth_, {kFinePolynomial, kVerlet, Precision::kDouble}), free.text(),
        touching.text()));
  }

  void scenes() {
    page_.text("## Scenes and their truths");
    page_.text(fmt::format(
        "Cloths of 1 m x 1 m: tropical wool (168 g/m^2, E = 2133 and 1671 N/m, B = 5.6 and 5.0 uN "
        "m, drag 0.02 kg/(m^2 s)) hung from two corners, as a flag in wind of 6 "
        "m/s, falling on a ball and on a table; a tarpaulin (B = 0.5 mN m) squashed by a tenth, "
        "which buckles; k_d = {} kg/s. Positions are compared at the end of the last frame, {} at "
        "most, up to which runs at the planned step and at half of it are within 1 mm everywhere: "
        "past that folds go their own ways, and an error says nothing. The planned step is 0.9 of "
        "the linear bound, rounded to divide a frame of 1/60 s.",
        kDamping, kMostFrames));
    page_.text(fmt::format(
        "Truth: runs in double at 1/8, 1/16 and 1/32 of the planned step, extrapolated to a step "
        "of 0 (Richardson) with the order that they show, held to 1 to 2. Its bending function is "
        "a polynomial of degree 24, {} from the exact one at most. Its error is stated as what "
        "the extrapolation added to the finest run (RMS), which is more than what is left. Where "
        "nothing is touched Runge-Kutta's finest runs, one by one, come as near it as {} m.",
        short_number(error_of_truths_bending()), nearest_by_runge_kutta().text()));
    std::vector<Cells> rows;
    for (const Measured& m : all_)
      rows.push_back({m.given.title(), fmt::format("{:.3f}", m.frames / 60.0),
                      fmt::format("{:.1f}", 1e6 / 60.0 / static_cast<double>(m.given.substeps)),
                      short_number(m.halved), short_number(m.truth.error),
                      fmt::format("{:.2f}", m.truth.order)});
    page_.table({"scene", "time s", "planned step us", "step and half differ by m",
                 "truth's error m", "its order"},
                rows);
  }

  void defaults() {
    page_.text("## The defaults");
    page_.text(
        "Verlet, 32 segments, single precision, the planned step. Beside them, of all settings "
        "measured: the fastest that is as close (within 2 %), if it saves a tenth; and the closest "
        "that takes no longer (within 5 %), if it is closer by a tenth. Where that is the default "
        "itself, nothing beats it.");
    std::vector<Cells> rows;
    int best_of = 0;
    for (const Measured& m : all_) {
      const Point& ours = m.defaults();
      const Point *fastest = &ours, *closest = &ours;
      for (const Point& p : m.points) {
        if (!p.finite) continue;
        if (p.rms <= 1.02 * ours.rms && p.time < std::min(fastest->time, 0.9 * ours.time))
          fastest = &p;
        if (p.time <= 1.05 * ours.time && p.rms < std::min(closest->rms, 0.9 * ours.rms))
          closest = &p;
      }
      const auto other = [&](const Point& p, double factor) {
        return &p == &ours ? "the default"
                           : fmt::format("{} ({:.2g} x)", name_of(p.setting), factor);
      };
      best_of += fastest == &ours && closest == &ours ? 1 : 0;
      rows.push_back({m.given.title(), number(1e3 * ours.time), short_number(ours.rms),
                      short_number(ours.largest), short_number(ours.energy),
                      other(*fastest, ours.time / fastest->time),
                      other(*closest, ours.rms / closest->rms)});
    }
    page_.table({"scene", "ms per s", "RMS m", "largest m", "energy J", "as close, faster by",
                 "as fast, closer by"},
                rows);
    page_.text(fmt::format("The default is not beaten in {} of {}.", best_of, all_.size()));
  }

  void accuracies() {
    page_.text("## Accuracies to choose from");
    page_.text(
        "What `solver.accuracy` gives a scene that says no more: RMS error in m and, in brackets, "
        "ms per simulated second. DRAFT lets a sheet stretch by 1 % under its own weight, where "
        "its textile would less, for longer steps, and its error is that; FINE is double precision "
        "at a quarter of the step. UNSHEARED, which DRAFT has as well, is the longer step that "
        "holds where threads cross nearly as in the flat sheet (`solver.step_bound`); DRAFT damps "
        "by velocities half a step old, too (VERLET_LAGGED). Between the two lies DRAFT with "
        "`solver.max_self_weight_strain` of 0.0013. The last column is what the next finer mesh "
        "changes.");
    std::vector<Cells> rows;
    std::array<Range, kAccuracies.size()> error, time;
    for (std::size_t k = 0; k < all_.size(); ++k) {
      const Measured& m = all_[k];
      const Point& standard = m.accuracies[1];
      Cells row = {m.given.title()};
      for (std::size_t a = 0; a < kAccuracies.size(); ++a) {
        const Point& p = m.accuracies[a];
        row.push_back(fmt::format("{} ({:.3g})", short_number(p.rms), 1e3 * p.time));
        error[a].add(p.rms);
        time[a].add(p.time / standard.time);
      }
      const auto moved = mesh_distance(k);
      row.push_back(moved ? short_number(rms(*moved)) : "");
      rows.push_back(row);
    }
    Cells columns = {"scene"};
    for (const NamedAccuracy& stated : kAccuracies) columns.emplace_back(stated.name);
    columns.emplace_back("mesh");
    page_.table(columns, rows);
    page_.text(fmt::format(
        "DRAFT is {} mm off and takes {} times what STANDARD does; STANDARD is {} mm off; FINE is "
        "{} mm off and takes {} times as long; with UNSHEARED STANDARD is {} mm off and takes {} "
        "times what it does else, with VERLET_LAGGED as well {} mm and {} times; DRAFT with 0.13 % "
        "is {} mm off and takes {} times.",
        error[0].text(1e-3), time[0].text(), error[1].text(1e-3), error[2].text(1e-3),
        time[2].text(), error[3].text(1e-3), time[3].text(), error[4].text(1e-3), time[4].text(),
        error[5].text(1e-3), time[5].text()));
  }

  void precision() {
    page_.text("## Single precision");
    page_.text(
        "RMS error in single over that in double, 32 segments; 1.5 is what is allowed at the "
        "planned step.");
    std::vector<Cells> rows;
    std::vector<const Case*> over;
    for (const Measured& m : all_) {
      if (!m.kernels()) continue;
      Cells row = {m.given.title()};
      for (const int finer : {1, 2, 4, 8}) {
        const Point* single = m.find({.finer = finer});
        const Point* twice = m.find({.precision = Precision::kDouble, .finer = finer});
        const double ratio = single->rms / twice->rms;
        if (finer == 1 && ratio > 1.5) over.push_back(&m.given);
        row.push_back(fmt::format("{:.3g}", ratio));
        if (finer == 1) {
          row.push_back(short_number(single->rms));
          row.push_back(fmt::format("{:.2f}", twice->time / single->time));
        }
      }
      std::rotate(row.begin() + 2, row.begin() + 4, row.end());
      rows.push_back(row);
    }
    page_.table({"scene", "planned step", "/ 2", "/ 4", "/ 8", "RMS m", "times faster"}, rows);
    if (over.empty()) page_.text("It is nowhere more.");
    for (const Case* given : over) {
      constexpr int kFrames = 2;
      page_.text(fmt::format(
          "**It is more in {}.** In single precision neighbours of a coordinate of 1 m lie 1.2e-07 "
          "m apart, and where connections are near their rest length those that only pull (eq. 2) "
          "make a pull of rounding to either side: after {} frames single and double are {} m "
          "apart there (RMS), {} m with the isometric law, whose connections push as well.",
          given->title(), kFrames, short_number(rounding(*given, ChoiKo{}, kFrames)),
          short_number(rounding(*given, Isometric{}, kFrames))));
    }
  }

  void segments() {
    page_.text("## Segments of the bending function");
    page_.text(
        "RMS error in m at the planned step by Verlet, single precision (series and exact: double, "
        "one by one), and, at an eighth of it, what is left. Optimal: breakpoints lie closer where "
        "f_b bends more. Folded: the segments sample the clamped function f_b*, as the paper seems "
        "to do.");
    Cells columns = {"evaluator"};
    for (const Measured& m : all_) columns.push_back(m.given.title());
    std::vector<Cells> rows;
    const auto add = [&](const std::string& name, const ChoiKo& law, int finer) {
      Cells row = {name};
      for (const Measured& m : all_) {
        const bool slow = law.evaluator == Evaluator::kSeries || law.evaluator == Evaluator::kExact;
        const bool plain = slow || !m.kernels();
        const bool fine = law.evaluator == Evaluator::kPolynomial && law.degree > 8;
        const Point* point =
            m.find({.law = law,
                    .precision = plain || fine ? Precision::kDouble : Precision::kSingle,
                    .finer = finer,
                    .plain = plain});
        row.push_back(point == nullptr ? "-" : short_number(point->rms));
      }
      rows.push_back(row);
    };
    for (const int segments : kSegments) {
      const ChoiKo law{.segments = segments};
      add(evaluator_name(law), law, 1);
    }
    for (const int segments : kOptimal) {
      const ChoiKo law{.segments = segments, .optimal_breakpoints = true};
      add(evaluator_name(law), law, 1);
    }
    for (const int segments : kFolded) {
      const ChoiKo law{.segments = segments, .fold_clamp = true};
      add(evaluator_name(law), law, 1);
    }
    const ChoiKo polynomial{.evaluator = Evaluator::kPolynomial};
    add(evaluator_name(polynomial), polynomial, 1);
    add("series", {.evaluator = Evaluator::kSeries}, 1);
    add("exact", {.evaluator = Evaluator::kExact}, 1);
    add("32 segments, step / 8", {}, 8);
    add("1024 segments, step / 8", {.segments = 1024}, 8);
    add("polynomial 24, step / 8, double", kFinePolynomial, 8);
    page_.table(columns, rows);
  }

  void speed() {
    page_.text("## What the paper's idea saves");
    page_.text(
        "A substep in us, whole, by Verlet. One by one: one connection after the other in double, "
        "as the paper's program does it; kernels: rows of particles in vectors. The paper says "
        "that segments are about six times faster than the series.");
    std::vector<Cells> rows;
    for (const Measured& m : all_) {
      const auto us = [&](const Setting& setting) {
        const Point* p = m.find(setting);
        return p == nullptr ? std::numeric_limits<double>::quiet_NaN() : 1e6 * p->time * p->substep;
      };
      const auto slow = [&](const ChoiKo& law) {
        return us({law, kVerlet, Precision::kDouble, 1, true});
      };
      const double series = slow({.evaluator = Evaluator::kSeries}), lines = slow({});
      const double single = us({});
      rows.push_back({m.given.title(), short_number(series),
                      short_number(slow({.evaluator = Evaluator::kExact})), short_number(lines),
                      short_number(us({.precision = Precision::kDouble})), short_number(single),
                      short_number(series / lines), short_number(series / single)});
    }
    page_.table({"scene", "series", "exact", "32 segments", "kernels, double", "kernels, single",
                 "segments save", "kernels in single save"},
                rows);
  }

  void orders() {
    page_.text("## Orders of convergence");
    page_.text(fmt::format(
        "Fitted to errors over steps, as far as they are more than three times the truth's. The "
        "sheet of {} is taut in its frame, with damping and drag, so that nothing switches: there "
        "a method has the order that theory gives it (truth: Runge-Kutta, extrapolated, good to {} "
        "m). In the scenes connections go slack and taut, and in the last two bodies are touched, "
        "which is of first order. All but the third column by the polynomial of degree 24, which "
        "leaves no error of its own; 32 segments do.",
        smooth_->given.title(), short_number(smooth_->truth.error)));
    const auto one_by_one = [&](const Measured& m, IntegratorKind kind) {
      return order_text(m, {kFinePolynomial, kind, Precision::kDouble, 1, true});
    };
    const auto integrators = [&](const Measured& m) {
      return Cells{one_by_one(m, IntegratorKind::kRk4), one_by_one(m, IntegratorKind::kMidpoint),
                   one_by_one(m, IntegratorKind::kEuler)};
    };
    std::vector<Cells> rows;
    const auto add = [&](const Measured& m, const std::string& fine, const std::string& lines) {
      Cells row = {m.given.title(), fine, lines};
      for (const std::string& cell : integrators(m)) row.push_back(cell);
      rows.push_back(row);
    };
    add(*smooth_, order_text(*smooth_, {kFinePolynomial, kVerlet, Precision::kDouble}), "");
    for (const Measured& m : all_) {
      const bool plain = !m.kernels();
      add(m, order_text(m, {kFinePolynomial, kVerlet, Precision::kDouble, 1, plain}),
          order_text(m, {{}, kVerlet, Precision::kDouble, 1, plain}));
    }
    page_.table(
        {"scene", "Verlet, polynomial 24", "Verlet, 32 segments", "RK4", "midpoint", "Euler"},
        rows);
  }

  void integrators() {
    page_.text("## Integrators");
    page_.text(
        "The polynomial of degree 24 in double, one by one. RMS error in m and, in brackets, ms "
        "per "
        "simulated second; a dash: the run diverged; empty: not measured.");
    const std::array<std::pair<IntegratorKind, int>, 11> columns = {{{kVerlet, 1},
                                                                     {kVerlet, 2},
                                                                     {kVerlet, 4},
                                                                     {IntegratorKind::kRk4, 1},
                                                                     {IntegratorKind::kRk4, 2},
                                                                     {IntegratorKind::kRk4, 4},
                                                                     {IntegratorKind::kMidpoint, 2},
                                                                     {IntegratorKind::kMidpoint, 4},
                                                                     {IntegratorKind::kMidpoint, 8},
                                                                     {IntegratorKind::kEuler, 16},
                                                                     {IntegratorKind::kEuler, 64}}};
    Cells names = {"scene"};
    for (const auto& [kind, finer] : columns)
      names.push_back(
          fmt::format("{}{}", integrator_name(kind), finer > 1 ? fmt::format(" / {}", finer) : ""));
    std::vector<Cells> rows;
    for (const Measured& m : all_) {
      Cells row = {m.given.title()};
      for (const auto& [kind, finer] : columns) {
        const Point* p = m.find({kFinePolynomial, kind, Precision::kDouble, finer, true});
        row.push_back(p == nullptr ? ""
                      : p->finite  ? fmt::format("{} ({:.3g})", short_number(p->rms), 1e3 * p->time)
                                   : "-");
      }
      rows.push_back(row);
    }
    page_.table(names, rows);
    Range ratio;
    for (const Measured& m : all_)
      if (!m.given.scene.colliders.empty())
        ratio.add(
            m.find({kFinePolynomial, IntegratorKind::kRk4, Precision::kDouble, 1, true})->rms /
            m.find({kFinePolynomial, kVerlet, Precision::kDouble, 1, true})->rms);
    page_.text(fmt::format(
        "Where bodies are touched Runge-Kutta is {} times as far off as Verlet at the same step: "
        "contact takes from a displacement what it pushed out of a position, which suits a method "
        "that has displacements for velocities.",
        ratio.text()));
  }

  void best() {
    page_.text("## Best settings");
    page_.text(
        "No other setting is both faster and closer. In the pictures a line joins the steps of one "
        "setting; Verlet where nothing else is said.");
    for (const Measured& m : all_) {
      page_.text("### " + m.given.title());
      std::vector<Cells> rows;
      for (const Point& p : pareto_best(m.points))
        rows.push_back(
            {name_of(p.setting) + (same(p.setting, m.defaults().setting) ? " (default)" : ""),
             number(1e3 * p.time), short_number(p.rms), short_number(p.largest),
             short_number(p.energy)});
      page_.table({"setting", "ms per s", "RMS m", "largest m", "energy J"}, rows);
      page_.plot(fmt::format("{}-{}", m.given.name, m.given.side), plot_of(m));
    }
  }

  // Of the line that a setting's steps make.
  static std::string line_name(const Setting& setting) {
    if (setting.integrator != kVerlet) return integrator_name(setting.integrator);
    const std::string how = setting.plain ? "one by one" : precision_name(setting);
    return evaluator_name(setting.law) + ", " + how;
  }

  static Plot plot_of(const Measured& m) {
    Plot plot{m.given.title(),
              "core seconds for a simulated second",
              "RMS error m",
              {},
              true,
              false,
              true};
    std::map<std::string, Series> lines;
    const auto add = [&](const std::string& name, const Point& p) {
      lines[name].name = name;
      lines[name].points.emplace_back(p.time, p.rms);
    };
    for (const Point& p : m.points) {
      if (!p.finite) continue;
      const bool like_default = line_name(p.setting) == line_name(m.defaults().setting);
      if (p.setting.finer == 1 && p.setting.law.evaluator == Evaluator::kLinearized &&
          !p.setting.law.fold_clamp && !p.setting.law.optimal_breakpoints &&
          p.setting.precision == m.defaults().setting.precision && p.setting.integrator == kVerlet)
        add("2 to 1024 segments", p);
      if (p.setting.law.evaluator == Evaluator::kSeries ||
          p.setting.law.evaluator == Evaluator::kExact) {
        if (p.setting.finer == 1) add("series, exact", p);
      } else if (like_default || p.setting.law.degree > 8) {
        add(line_name(p.setting), p);
      }
    }
    for (const auto& [name, line] : lines) plot.series.push_back(line);
    return plot;
  }

  // From a case's truth to that on the next finer mesh, at the particles of the coarser one.
  std::optional<Matrix3Xd> mesh_distance(std::size_t k) const {
    if (k + 1 == all_.size() || all_[k].given.name != all_[k + 1].given.name) return std::nullopt;
    const Measured &coarse = all_[k], &fine = all_[k + 1];
    const int stride = (fine.given.side - 1) / (coarse.given.side - 1);
    Matrix3Xd moved = -coarse.truth.x;
    for (int row = 0, i = 0; row < coarse.given.side; ++row)
      for (int column = 0; column < coarse.given.side; ++column, ++i)
        moved.col(i) += fine.truth.x.col(stride * (row * fine.given.side + column));
    return moved;
  }

  // What a finer mesh changes, beside which a solver's error is to be seen.
  void resolution() {
    page_.text("## What the mesh changes");
    page_.text(
        "Distance between the truths of a scene on one mesh and on the next finer one, at the "
        "particles that both have: the error of the model's mesh, beside that of the defaults on "
        "the coarser one.");
    std::vector<Cells> rows;
    for (std::size_t k = 0; k < all_.size(); ++k) {
      const auto moved = mesh_distance(k);
      if (!moved) continue;
      const Measured &coarse = all_[k], &fine = all_[k + 1];
      rows.push_back(
          {fmt::format("{}, {} to {}", coarse.given.name, coarse.given.side, fine.given.side),
           short_number(rms(*moved)), short_number(largest(*moved)),
           short_number(coarse.defaults().rms)});
    }
    page_.table({"scene, particles a side", "RMS m", "largest m", "default's RMS m"}, rows);
  }

  void triangles() {
    page_.text("## Sheets of triangles");
    page_.text(
        "The same cloths on triangles between points of that lattice, each moved by up to 0.3 of "
        "the spacing, with their membrane and fitted curvatures; truths as above. RMS error in m "
        "and, in brackets, ms per simulated second.");
    std::vector<Cells> rows;
    for (const Measured& m : triangles_) {
      Cells row = {m.given.title(),
                   fmt::format("{:.1f}", 1e6 / 60.0 / static_cast<double>(m.given.substeps)),
                   fmt::format("{} ({:.2f})", short_number(m.truth.error), m.truth.order)};
      const auto add = [&](const Point& p) {
        row.push_back(fmt::format("{} ({:.3g})", short_number(p.rms), 1e3 * p.time));
      };
      for (const auto precision : {Precision::kSingle, Precision::kDouble})
        for (const int finer : {1, 4}) add(*m.find({.precision = precision, .finer = finer}));
      for (const Point& p : m.accuracies) add(p);
      row.push_back(order_text(m, {.precision = Precision::kDouble}));
      rows.push_back(row);
    }
    page_.table({"scene", "planned step us", "truth's error m (order)", "single", "single, / 4",
                 "double", "double, / 4", "DRAFT", "STANDARD", "FINE", "UNSHEARED", "VERLET_LAGGED",
                 "DRAFT, 0.13 %", "Verlet's order"},
                rows);
  }

  void model() {
    model_errors(page_);
    double shortest = all_.front().given.scene.solver.frame_step, longest = 0;
    for (const Measured& m : all_) {
      const double step = m.given.scene.solver.frame_step / static_cast<double>(m.given.substeps);
      shortest = std::min(shortest, step);
      longest = std::max(longest, step);
    }
    page_.text(fmt::format(
        "A step of 0.1 s is not one that cloth bears: here {:.2g} to {:.2g} ms are planned, a "
        "{:.0f}th to a {:.0f}th of it.",
        1e3 * shortest, 1e3 * longest, 0.1 / longest, 0.1 / shortest));
  }

  Page page_;
  std::vector<Measured> all_;  // sides of a scene in order
  std::vector<Measured> triangles_;
  std::optional<Measured> smooth_;
};

}  // namespace

void accuracy(const std::filesystem::path& folder, const std::string& commit, bool large) {
  const std::vector<int> sides = large ? std::vector{16, 31, 61} : std::vector{16, 31};
  AccuracyPage page(folder, commit);
  for (const char* name : {"hang", "buckle", "flag", "sphere", "box"}) {
    std::vector<Case> cases;
    int frames = kMostFrames;
    for (const int side : sides) {
      cases.push_back(make_case(name, side));
      frames = calm_frames(cases.back(), frames);
    }
    frames = std::max(frames, 1);
    progress(fmt::format("{}: {} frames", name, frames));
    for (const Case& given : cases) page.add(measure(given, frames, large));
  }
  page.add(measure(make_case("taut", 16), 6, large));
  for (const char* name : {"hang", "flag", "sphere", "box"}) {
    const Case given = make_triangle_case(name, 31);
    page.add(measure(given, std::max(calm_frames(given, kMostFrames), 1), large));
  }
  page.write();
}

}  // namespace weft::reports

#include "tests/reports/measurements.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>

#include "core/sheet_factory.h"

namespace weft::reports {

void progress(const std::string& what) {
  static const auto start = std::chrono::steady_clock::now();
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start;
  fmt::print(stderr, "{:6.1f} s  {}\n", passed.count(), what);
}

std::string precision_name(const Setting& setting) {
  return setting.precision == Precision::kSingle ? "single" : "double";
}

std::string name_of(const Setting& setting) {
  return fmt::format("{}, {}, {}{}{}", integrator_name(setting.integrator),
                     evaluator_name(setting.law), precision_name(setting),
                     setting.plain ? ", one by one" : "",
                     setting.finer > 1 ? fmt::format(", step / {}", setting.finer) : "");
}

bool same(const Setting& a, const Setting& b) { return name_of(a) == name_of(b); }

namespace {

// What a case is computed with. Wind leaves no choice of precision: all is in double, one by one.
std::vector<Setting> settings_for(const Case& given, bool large) {
  const bool kernels = needs_plain_solver(given.scene, given.scene.sheets[0]).empty();
  const bool small = given.side <= 16 || large;
  std::vector<Setting> settings;
  const auto add = [&](const Setting& wanted) {
    Setting setting = wanted;
    if (!kernels) setting = {wanted.law, wanted.integrator, Precision::kDouble, wanted.finer, true};
    if (std::none_of(settings.begin(), settings.end(),
                     [&](const Setting& other) { return same(other, setting); }))
      settings.push_back(setting);
  };
  const auto one_by_one = [&](const ChoiKo& law, IntegratorKind kind, int finer) {
    add({law, kind, Precision::kDouble, finer, true});
  };

  if (given.triangles) {
    for (const int finer : {1, 2, 4, 8})
      for (const auto precision : {Precision::kSingle, Precision::kDouble})
        add({.precision = precision, .finer = finer});
    return settings;
  }
  if (given.smooth) {
    for (const int finer : {1, 2, 4, 8}) {
      add({.law = kFinePolynomial, .precision = Precision::kDouble, .finer = finer});
      one_by_one(kFinePolynomial, IntegratorKind::kRk4, finer);
      one_by_one(kFinePolynomial, IntegratorKind::kMidpoint, 4 * finer);
    }
    for (const int finer : {32, 64, 128})
      one_by_one(kFinePolynomial, IntegratorKind::kEuler, finer);
    return settings;
  }

  for (const int segments : kSegments) add({.law = {.segments = segments}});
  for (const int segments : kOptimal)
    add({.law = {.segments = segments, .optimal_breakpoints = true}});
  for (const int segments : kFolded) add({.law = {.segments = segments, .fold_clamp = true}});
  add({.law = {.evaluator = Evaluator::kPolynomial}});
  one_by_one({}, kVerlet, 1);
  one_by_one({.evaluator = Evaluator::kSeries}, kVerlet, 1);
  one_by_one({.evaluator = Evaluator::kExact}, kVerlet, 1);
  for (const int finer : {1, 2, 4, 8}) {
    add({.finer = finer});
    add({.precision = Precision::kDouble, .finer = finer});
    if (kernels || large) add({.law = {.segments = 1024}, .finer = finer});
    add({.law = kFinePolynomial, .precision = Precision::kDouble, .finer = finer});
    const int most = small ? 4 : 2;
    if (finer <= most) one_by_one(kFinePolynomial, kVerlet, finer);
    if (finer <= most) one_by_one(kFinePolynomial, IntegratorKind::kRk4, finer);
    if (finer >= 2 && finer <= 2 * most)
      one_by_one(kFinePolynomial, IntegratorKind::kMidpoint, finer);
    if (!large) continue;
    for (const int segments : kSegments)
      for (const auto precision : {Precision::kSingle, Precision::kDouble})
        add({.law = {.segments = segments}, .precision = precision, .finer = finer});
    add({.law = {.evaluator = Evaluator::kPolynomial}, .finer = finer});
    one_by_one({.evaluator = Evaluator::kSeries}, kVerlet, finer);
    one_by_one({.evaluator = Evaluator::kExact}, kVerlet, finer);
  }
  if (small)
    for (const int finer : {16, 64}) one_by_one(kFinePolynomial, IntegratorKind::kEuler, finer);
  return settings;
}

}  // namespace

Measured measure(const Case& given, int frames, bool large) {
  Measured measured{given, frames, {}, 0, {}, {}};
  progress(given.title() + ": truth");
  measured.truth = find_truth(given, frames);
  const Setting planned{.precision = Precision::kDouble},
      halved{.precision = Precision::kDouble, .finer = 2};
  measured.halved = largest(run(given, planned, frames).x - run(given, halved, frames).x);

  const std::vector<Setting> settings = settings_for(given, large);
  progress(fmt::format("{}: {} settings", given.title(), settings.size()));
  const auto point_of = [&](const Setting& setting, const Outcome& outcome) {
    Point point{setting, outcome.finite, outcome.time, outcome.substep};
    const double unknown = std::numeric_limits<double>::quiet_NaN();
    point.rms = outcome.finite ? rms(outcome.x - measured.truth.x) : unknown;
    point.largest = outcome.finite ? largest(outcome.x - measured.truth.x) : unknown;
    point.energy = outcome.finite ? std::abs(outcome.energy - measured.truth.energy) : unknown;
    return point;
  };
  for (const Setting& setting : settings)
    measured.points.push_back(point_of(setting, run(given, setting, frames)));
  for (const NamedAccuracy& stated : kAccuracies)
    measured.accuracies.push_back(point_of({}, run(given, stated, frames)));
  // short runs once more, and again, but not at once: what disturbs one does not last
  constexpr double kShort = 0.2;  // s
  for (int repeat = 0; repeat < 2; ++repeat) {
    for (Point& point : measured.points)
      if (point.finite && point.time * frames * given.scene.solver.frame_step < kShort)
        point.time = std::min(point.time, run(given, point.setting, frames).time);
    for (std::size_t k = 0; k < kAccuracies.size(); ++k)
      measured.accuracies[k].time =
          std::min(measured.accuracies[k].time, run(given, kAccuracies[k], frames).time);
  }
  return measured;
}

std::vector<Point> pareto_best(std::vector<Point> points) {
  std::sort(points.begin(), points.end(),
            [](const Point& a, const Point& b) { return a.time < b.time; });
  std::vector<Point> best;
  for (const Point& point : points)
    if (point.finite && (best.empty() || point.rms < 0.99 * best.back().rms)) best.push_back(point);
  return best;
}

double order_of(const Measured& measured, const Setting& like) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const Point& point : measured.points) {
    Setting setting = like;
    setting.finer = point.setting.finer;
    if (!point.finite || !same(point.setting, setting) || point.rms < 3 * measured.truth.error)
      continue;
    const double x = std::log(point.substep), y = std::log(point.rms);
    ++n, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return n < 2 ? std::numeric_limits<double>::quiet_NaN()
               : (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

}  // namespace weft::reports

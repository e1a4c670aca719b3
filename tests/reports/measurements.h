#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "tests/reports/trial.h"

// What the accuracy page shows: cases, each at many settings, against its truth.
namespace weft::reports {

inline constexpr int kMostFrames = 12;
inline constexpr auto kVerlet = IntegratorKind::kVerlet;
inline constexpr ChoiKo kFinePolynomial{.evaluator = Evaluator::kPolynomial, .degree = 24};
inline constexpr std::array kSegments = {2, 5, 8, 16, 32, 60, 128, 256, 1024};
inline constexpr std::array kOptimal = {5, 16, 32, 60};
inline constexpr std::array kFolded = {2, 5, 60};  // as the paper's figure 7 has them
inline constexpr std::array kAccuracies = {
    NamedAccuracy{"DRAFT", Accuracy::kDraft},
    NamedAccuracy{"STANDARD", Accuracy::kStandard},
    NamedAccuracy{"FINE", Accuracy::kFine},
    NamedAccuracy{"STANDARD, UNSHEARED", Accuracy::kStandard, StepBound::kUnsheared},
    NamedAccuracy{"the same, VERLET_LAGGED", Accuracy::kStandard, StepBound::kUnsheared,
                  IntegratorKind::kLaggedVerlet},
    NamedAccuracy{
        .name = "DRAFT, 0.13 %", .accuracy = Accuracy::kDraft, .self_weight_strain = 0.0013}};

// A setting and how far from the truth it ends.
struct Point {
  Setting setting;
  bool finite = false;
  double time = 0;                          // of a core for a simulated second, s
  double substep = 0;                       // s
  double rms = 0, largest = 0, energy = 0;  // errors: m, m, J
};

std::string precision_name(const Setting& setting);
std::string name_of(const Setting& setting);
bool same(const Setting& a, const Setting& b);

// A case and all that was measured in it.
struct Measured {
  Case given;
  int frames = 0;
  Truth truth;
  double halved = 0;  // largest distance of runs at the planned step and at half of it, m
  std::vector<Point> accuracies;  // of kAccuracies; their setting says nothing
  std::vector<Point> points;

  const Point* find(const Setting& setting) const {
    const auto found = std::find_if(points.begin(), points.end(), [&](const Point& point) {
      return same(point.setting, setting);
    });
    return found == points.end() ? nullptr : &*found;
  }
  bool kernels() const { return !points.front().setting.plain; }
  // The defaults, in double where there are no kernels.
  const Point& defaults() const {
    const Setting in_double{.precision = Precision::kDouble, .plain = true};
    return *find(kernels() ? Setting{} : in_double);
  }
};

Measured measure(const Case& given, int frames, bool large);

// No other is both faster and closer.
std::vector<Point> pareto_best(std::vector<Point> points);

// Slope of log error over log step by least squares, of points that the truth can tell apart; not a
// number where they are too few.
double order_of(const Measured& measured, const Setting& like);

// How long it has taken so far, and what comes next.
void progress(const std::string& what);

}  // namespace weft::reports

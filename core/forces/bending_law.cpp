#include "core/forces/bending_law.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace weft {
namespace {

constexpr double kSlopeAtZero = 12 * std::numbers::pi * std::numbers::pi;  // g'(0), its largest

// 1 - sinc(u) = s solved for q = u^2: in q both sinc and cos u - sinc u are entire series, so that
// nothing cancels near r = 1.
double squared_half_angle(double s) {
  double q = s * (6 + s * (1.8 + s * 2));
  for (int iteration = 0; iteration < 20; ++iteration) {
    double value = 0, slope = 0, term = 1.0 / 6;  // term: q^(k-1) / (2k+1)!, alternating
    for (int k = 1; k <= 16; ++k) {
      value += term * q;
      slope += term * k;
      term *= -q / ((2 * k + 2) * (2 * k + 3));
    }
    const double change = (value - s) / slope;
    q -= change;
    if (std::abs(change) <= 4e-16 * q) break;
  }
  return q;
}

// Integral of a smooth function by ten-point Gauss-Legendre quadrature on each half of the
// interval.
template <class F>
double quadrature(const F& f, double from, double to) {
  constexpr std::array<double, 5> node = {0.1488743389816312, 0.4333953941292472,
                                          0.6794095682990244, 0.8650633666889845,
                                          0.9739065285171717};
  constexpr std::array<double, 5> weight = {0.2955242247147529, 0.2692667193099963,
                                            0.2190863625159820, 0.1494513491505806,
                                            0.0666713443086881};
  double sum = 0;
  const double quarter = (to - from) / 4;
  for (int half = 0; half < 2; ++half) {
    const double middle = from + quarter * (1 + 2 * half);
    for (std::size_t i = 0; i < node.size(); ++i)
      sum += weight[i] * (f(middle - quarter * node[i]) + f(middle + quarter * node[i]));
  }
  return sum * quarter;
}

}  // namespace

double ExactBending::value(double r) const {
  const double q = squared_half_angle(1 - r);
  double denominator = 0,
         term = -1.0 / 6;  // (cos u - sinc u) / u^2 = sum (-1)^k 2k q^(k-1) / (2k+1)!
  for (int k = 1; k <= 16; ++k) {
    denominator += 2 * k * term;
    term *= -q / ((2 * k + 2) * (2 * k + 3));
  }
  return 4 / denominator;
}

// g is the slope of 2 u^2, the energy of an arc of curvature 2 u / L.
double ExactBending::integral(double r) const { return 2 * squared_half_angle(1 - r); }

double SeriesBending::value(double r) const {
  if (r > 1 - 1e-8) return -12;  // 0/0 in the closed form
  const double x2 = 1 - r;
  double f = 0;
  for (const double coefficient : kCoefficients) f = f * x2 + coefficient;
  const double u = std::sqrt(1.5 * x2) * f;
  return 4 * u * u / (std::cos(u) - r);
}

double SeriesBending::integral(double r) const {
  return quadrature([this](double at) { return value(at); }, 1, r);
}

namespace {

// breakpoint_map() solved for r.
double breakpoint(const Breakpoints& b, double at) {
  double r = at;
  for (int iteration = 0; iteration < 10; ++iteration)
    r -= (breakpoint_map(b, r) - at) / (b[0] + r * (2 * b[1] + r * (3 * b[2] + r * 4 * b[3])));
  return r;
}

}  // namespace

LinearizedBending::LinearizedBending(int segments, std::optional<double> clamp,
                                     const Breakpoints& breakpoints)
    : breakpoints_(breakpoints), segments_(static_cast<std::size_t>(segments)), count_(segments) {
  const ExactBending exact;
  const auto node = [&](double r) {
    const double g = exact.value(r);
    return clamp ? std::max(g, *clamp * (r - 1)) : g;
  };
  double end = 1, upper = node(end), integral = 0;
  for (int i = segments - 1; i >= 0; --i) {
    const double begin = breakpoint(breakpoints, static_cast<double>(i) / segments);
    const double lower = node(begin);
    Segment& segment = segments_[static_cast<std::size_t>(i)];
    segment.slope = (upper - lower) / (end - begin);
    segment.intercept = lower - segment.slope * begin;
    segment.end = end;
    segment.integral = integral;
    integral -= (lower + upper) / 2 * (end - begin);
    end = begin;
    upper = lower;
  }
}

double LinearizedBending::integral(double r) const {
  const Segment& at = segment(r);
  return at.integral - (at.end - r) * (at.intercept + at.slope * (at.end + r) / 2);
}

PolynomialBending::PolynomialBending(int degree) {
  const int count = degree + 1;
  const ExactBending exact;
  std::vector<double> sample(static_cast<std::size_t>(count));
  for (int j = 0; j < count; ++j)
    sample[static_cast<std::size_t>(j)] =
        exact.value((1 + std::cos(std::numbers::pi * (j + 0.5) / count)) / 2);

  // sum of chebyshev T_k, each expanded in powers of t by T_k = 2 t T_(k-1) - T_(k-2)
  const auto size = static_cast<std::size_t>(count);
  std::vector<double> powers(size), before(size), current(size), next(size);
  current[0] = 1;
  for (int k = 0; k < count; ++k) {
    double coefficient = 0;
    for (int j = 0; j < count; ++j)
      coefficient +=
          sample[static_cast<std::size_t>(j)] * std::cos(std::numbers::pi * k * (j + 0.5) / count);
    coefficient *= (k == 0 ? 1.0 : 2.0) / count;
    for (std::size_t i = 0; i < size; ++i) powers[i] += coefficient * current[i];
    const double factor = k == 0 ? 1 : 2;
    for (std::size_t i = 0; i < size; ++i)
      next[i] = (i > 0 ? factor * current[i - 1] : 0) - (k == 0 ? 0 : before[i]);
    before = current;
    current = next;
  }
  coefficients_.assign(powers.rbegin(), powers.rend());
}

double PolynomialBending::value(double r) const {
  const double t = 2 * r - 1;
  double g = 0;
  for (const double coefficient : coefficients_) g = g * t + coefficient;
  return g;
}

double PolynomialBending::primitive(double t) const {
  double sum = 0;
  auto power = static_cast<double>(coefficients_.size());
  for (const double coefficient : coefficients_) sum = sum * t + coefficient / power--;
  return sum * t;
}

double PolynomialBending::integral(double r) const {
  return (primitive(2 * r - 1) - primitive(1)) / 2;
}

namespace {

BendingFunction make_function(const ChoiKo& law, double clamp) {
  switch (law.evaluator) {
    case Evaluator::kSeries:
      return SeriesBending();
    case Evaluator::kExact:
      return ExactBending();
    case Evaluator::kPolynomial:
      return PolynomialBending(law.degree);
    case Evaluator::kLinearized:
      break;
  }
  if (law.fold_clamp) return LinearizedBending(law.segments, clamp);
  return LinearizedBending(law.segments, std::nullopt,
                           law.optimal_breakpoints ? kOptimalBreakpoints : kEqualBreakpoints);
}

// The range of r in which g lies above the clamp. g(r) - clamp (r - 1) is concave and negative at
// r = 1, so the range is one interval; empty where its peak is negative.
template <class Function>
std::pair<double, double> range_of_curve(const Function& g, double clamp) {
  const auto excess = [&](double r) { return g.value(r) - clamp * (r - 1); };
  double low = 0, high = 1;
  for (int i = 0; i < 200; ++i) {
    const double a = low + (high - low) * 0.4, b = low + (high - low) * 0.6;
    (excess(a) < excess(b) ? low : high) = excess(a) < excess(b) ? a : b;
  }
  const double peak = (low + high) / 2;
  if (excess(peak) <= 0 && excess(0) <= 0) return {0, 0};
  const auto crossing = [&](double inside, double outside) {
    for (int i = 0; i < 200; ++i) {
      const double middle = (inside + outside) / 2;
      (excess(middle) > 0 ? inside : outside) = middle;
    }
    return inside;
  };
  const double inside = excess(peak) > 0 ? peak : 0;
  return {excess(0) > 0 ? 0 : crossing(inside, 0), crossing(inside, 1)};
}

}  // namespace

BendingForce::BendingForce(const ChoiKo& law, double bend, double clamp, double rest_length)
    : function_(SeriesBending()),
      rest_length_(rest_length),
      inverse_length_(1 / rest_length),
      scale_(bend / (rest_length * rest_length)),
      clamp_(clamp) {
  const double normalized = clamp * rest_length / scale_;
  function_ = make_function(law, normalized);
  if (law.evaluator == Evaluator::kLinearized && law.fold_clamp) {
    curve_end_ = 2;  // the table holds the clamp
    clamp_rules_ = normalized < kClampRules;
  } else {
    std::tie(curve_begin_, curve_end_) =
        std::visit([&](const auto& g) { return range_of_curve(g, normalized); }, function_);
    clamp_rules_ = curve_begin_ >= curve_end_;
  }
  end_integral_ =
      std::visit([&](const auto& g) { return g.integral(std::min(curve_end_, 1.0)); }, function_);
}

double BendingForce::energy(double length) const {
  return std::visit([&](const auto& g) { return energy(g, length); }, function_);
}

double BendingForce::least_curvature() const {
  return std::sqrt(288 * scale_ / (clamp_ * rest_length_ * rest_length_ * rest_length_));
}

double BendingForce::slope(double length) const {
  const double step = 1e-6 * rest_length_;
  return std::visit(
      [&](const auto& g) {
        const double low = std::max(length - step, 0.0),
                     high = std::min(length + step, rest_length_);
        return (force(g, high) - force(g, low)) / (high - low);
      },
      function_);
}

double BendingForce::largest_slope() const {
  return clamp_rules_ ? clamp_ : std::max(clamp_, kSlopeAtZero * scale_ * inverse_length_);
}

}  // namespace weft

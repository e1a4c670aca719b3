#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "core/model/scene.h"

namespace weft {

// The universal bending curve g(r), r = l / L in [0, 1], of eq. 3 and 4: a bend connection of rest
// length L pushes with f_b = (k_b / L^2) g(r). With u = asinc(r): g = 4 u^2 / (cos u - r), g(1) =
// -12. Every evaluator has value(r) = g(r) and integral(r), the integral of g from 1 to r.

// Newton iteration, good to the last bits of double.
class ExactBending {
 public:
  double value(double r) const;
  double integral(double r) const;
};

// Eq. 6 (Cantrell's series), ten terms, with the misprinted denominator and prefactor corrected:
// asinc(r) = sqrt(3/2) f(sqrt(1 - r)). Largest relative error 0.82 %, at r = 0.
class SeriesBending {
 public:
  double value(double r) const;
  double integral(double r) const;

  // Of powers of 1 - r, highest first.
  static constexpr std::array<double, 10> kCoefficients = {
      910588298588385889.0 / 228420612259840000000.0,
      6670995251837391.0 / 1165411287040000000.0,
      14328608561991.0 / 1707689984000000.0,
      317184685563.0 / 25113088000000.0,
      1766784699.0 / 89689600000.0,
      445617.0 / 13798400.0,
      3197.0 / 56000.0,
      321.0 / 2800.0,
      3.0 / 10.0,
      2.0};
};

// Where breakpoints lie: w(r) = i / segments, w = r (b0 + r (b1 + r (b2 + r b3))), which rises from
// 0 to 1. No segment has to be searched for.
using Breakpoints = std::array<double, 4>;
inline double breakpoint_map(const Breakpoints& b, double r) {
  return r * (b[0] + r * (b[1] + r * (b[2] + r * b[3])));
}
inline constexpr Breakpoints kEqualBreakpoints = {1};
// A chord of width h is off by h^2 / 8 g'' / g: of all such w the one whose slope is the least
// below sqrt(g'' / g), where all segments would be as good as each other. The largest relative
// error is at most an eighth above the smallest that so many segments can have.
inline constexpr Breakpoints kOptimalBreakpoints = {2.420325, -3.230788, 2.73076, -0.920297};

// Line segments over [0, 1], the paper's contribution. Between the nodes |g| is overestimated.
class LinearizedBending {
 public:
  // With a clamp = c_b L^3 / k_b the nodes sample max(g(r), clamp (r - 1)) (fold_clamp, eq. 5).
  explicit LinearizedBending(int segments, std::optional<double> clamp = std::nullopt,
                             const Breakpoints& breakpoints = kEqualBreakpoints);
  double value(double r) const {
    const Segment& at = segment(r);
    return at.intercept + at.slope * r;
  }
  double integral(double r) const;

  // g(r) = intercept + slope r, for r up to end.
  struct Segment {
    double intercept, slope, end, integral;  // integral of g from 1 to end
  };
  const std::vector<Segment>& segments() const { return segments_; }
  const Breakpoints& breakpoints() const { return breakpoints_; }

 private:
  const Segment& segment(double r) const {
    const auto i = static_cast<std::int64_t>(breakpoint_map(breakpoints_, r) * count_);
    return segments_[std::min(static_cast<std::size_t>(i), segments_.size() - 1)];
  }
  Breakpoints breakpoints_;
  std::vector<Segment> segments_;
  double count_;
};

// Chebyshev interpolation of g.
class PolynomialBending {
 public:
  explicit PolynomialBending(int degree);
  double value(double r) const;
  double integral(double r) const;

  // Of powers of t = 2 r - 1, highest first.
  const std::vector<double>& coefficients() const { return coefficients_; }

 private:
  double primitive(double t) const;
  std::vector<double> coefficients_;
};

using BendingFunction =
    std::variant<SeriesBending, ExactBending, LinearizedBending, PolynomialBending>;

// The clamped bending force of one family of connections (eq. 3 to 5).
class BendingForce {
 public:
  // bend: k_b > 0, N m^2; clamp: c_b > 0, N/m; rest_length: L, m.
  BendingForce(const ChoiKo& law, double bend, double clamp, double rest_length);

  // Force over the connection, negative: it pushes apart. length <= L, both in m; N.
  template <class Function>
  double force(const Function& g, double length) const {
    const double r = length * inverse_length_;
    if (r >= curve_end_ || r < curve_begin_) return clamp_ * (length - rest_length_);
    return scale_ * g.value(r);
  }
  const BendingFunction& function() const { return function_; }
  double scale() const { return scale_; }              // k_b / L^2, N
  double clamp() const { return clamp_; }              // c_b, N/m
  double rest_length() const { return rest_length_; }  // L, m

  // J
  template <class Function>
  double energy(const Function& g, double length) const {
    const double r = std::min(length * inverse_length_, 1.0), end = std::min(curve_end_, 1.0);
    if (clamp_rules_ || r >= end) return clamp_energy(1, r);
    const double curve =
        scale_ * rest_length_ * (g.integral(std::max(r, curve_begin_)) - end_integral_);
    return clamp_energy(1, end) + curve + (r < curve_begin_ ? clamp_energy(curve_begin_, r) : 0);
  }
  double energy(double length) const;

  double slope(double length) const;  // d force / d length, N/m
  double largest_slope() const;       // bound of slope() over all lengths, N/m
  // kappa* = sqrt(288 k_b / (c_b L^5)), 1/m: less bent than this, the clamp holds the connection.
  double least_curvature() const;
  // Whether the clamp rules for every length, so that k_b has no effect.
  bool clamp_rules() const { return clamp_rules_; }

 private:
  // Of the clamp between two r, from > to, J.
  double clamp_energy(double from, double to) const {
    return clamp_ / 2 * rest_length_ * rest_length_ *
           ((1 - to) * (1 - to) - (1 - from) * (1 - from));
  }

  BendingFunction function_;
  double rest_length_, inverse_length_;
  double scale_;  // k_b / L^2
  double clamp_;  // c_b
  bool clamp_rules_ = true;
  double curve_begin_ = 0, curve_end_ = 0;  // range of r in which g rules, not the clamp
  double end_integral_ = 0;                 // of g, at the end of that range
};

// Below this c_b L^3 / k_b the clamp of eq. 5 lies above g everywhere.
inline constexpr double kClampRules = 31.47;

}  // namespace weft

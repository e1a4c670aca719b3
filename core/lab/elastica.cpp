#include "core/lab/elastica.h"

#include <cmath>
#include <numbers>

namespace weft {
namespace {

using State = Eigen::Vector4d;  // theta, theta', x, drop

State slope(double q, double s, const State& y) {
  return {y[1], -q * (1 - s) * std::cos(y[0]), std::cos(y[0]), std::sin(y[0])};
}

// Runge and Kutta's steps from the clamp, where the strip is level and bent by `curvature`.
Eigen::Matrix4Xd shoot(double q, double curvature, int steps) {
  Eigen::Matrix4Xd y(4, steps + 1);
  y.col(0) = State(0, curvature, 0, 0);
  const double h = 1.0 / steps;
  for (int k = 0; k < steps; ++k) {
    const double s = k * h;
    const State now = y.col(k);
    const State a = slope(q, s, now), b = slope(q, s + h / 2, now + h / 2 * a);
    const State c = slope(q, s + h / 2, now + h / 2 * b), d = slope(q, s + h, now + h * c);
    y.col(k + 1) = now + h / 6 * (a + 2 * b + 2 * c + d);
  }
  return y;
}

}  // namespace

Eigen::Matrix2Xd heavy_elastica(double q, int points) {
  constexpr int kSteps = 2000;
  const int each = (kSteps + points - 2) / (points - 1);  // steps between points
  const int steps = each * (points - 1);
  // the curvature at the clamp at which the tip is free: theta'(1) grows with it
  double low = 0, high = q;
  for (int k = 0; k < 200 && high - low > 1e-15 * high; ++k) {
    const double middle = (low + high) / 2;
    (shoot(q, middle, steps)(1, steps) < 0 ? low : high) = middle;
  }
  const Eigen::Matrix4Xd y = shoot(q, high, steps);
  Eigen::Matrix2Xd shape(2, points);
  for (int k = 0; k < points; ++k) shape.col(k) = y.col(k * each).tail<2>();
  return shape;
}

double chord_angle(double x, double drop) { return std::atan2(drop, x) * 180 / std::numbers::pi; }

// With the tension H at the lowest point, s from there: x = H s / E + H / w asinh(w s / H),
// height = w s^2 / (2 E) + H / w (sqrt(1 + (w s / H)^2) - 1).
Eigen::Matrix2Xd elastic_catenary(double stiffness, double weight, double length, double span,
                                  int points) {
  const auto x = [&](double tension, double s) {
    return tension * s / stiffness + tension / weight * std::asinh(weight * s / tension);
  };
  const auto height = [&](double tension, double s) {
    return weight * s * s / (2 * stiffness) +
           tension / weight * (std::hypot(1, weight * s / tension) - 1);
  };
  double low = 1e-9 * weight * length, high = 1e-3 * weight * length;
  while (2 * x(high, length / 2) < span) high *= 2;
  for (int k = 0; k < 200; ++k) {
    const double middle = (low + high) / 2;
    (2 * x(middle, length / 2) < span ? low : high) = middle;
  }
  Eigen::Matrix2Xd shape(2, points);
  for (int k = 0; k < points; ++k) {
    const double s = length * (static_cast<double>(k) / (points - 1) - 0.5);
    shape.col(k) =
        Eigen::Vector2d(x(high, s) + span / 2, height(high, length / 2) - height(high, s));
  }
  return shape;
}

}  // namespace weft

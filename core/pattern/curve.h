#pragma once

#include "core/pattern/pattern.h"

namespace weft {

// An edge of an outline, by the share of its length.
class Curve {
 public:
  // Precondition: it has one to three points.
  Curve(const Vector2d& start, const PatternEdge& edge);

  double length() const { return length_; }  // m
  Vector2d at(double share) const;
  // Angle by which it turns between two shares, all turns counted, rad.
  double turning(double from, double to) const;
  // Whether it is an arc whose three points lie on a line, the middle one outside.
  bool is_broken() const { return broken_; }

 private:
  Vector2d point(double t) const;
  double parameter(double share) const;

  std::vector<Vector2d> points_;  // with the start
  Vector2d center_ = Vector2d::Zero();
  double angle_ = 0;  // of an arc, rad, anticlockwise; 0: none
  double length_ = 0;
  bool broken_ = false;
  std::vector<double> lengths_;  // of a Bezier curve up to each of equal steps of its parameter
};

inline double cross2(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// With 0 for coordinates so small, m, that products of them would underflow where signs are exact.
inline Vector2d without_dust(const Vector2d& point) {
  constexpr double kDust = 1e-30;
  return (point.array().abs() < kDust).select(0, point.array()).matrix();
}

// Where each edge of a panel runs.
std::vector<Curve> outline_of(const PatternPanel& panel);

}  // namespace weft

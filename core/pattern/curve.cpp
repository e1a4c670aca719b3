#include "core/pattern/curve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace weft {
namespace {

constexpr int kSteps = 256;

// Of Gauss and Legendre on -1 to 1.
constexpr std::array kNodes = {-0.7745966692414834, 0.0, 0.7745966692414834};
constexpr std::array kWeights = {5.0 / 9, 8.0 / 9, 5.0 / 9};

Vector2d bezier(std::vector<Vector2d> points, double t) {
  for (std::size_t left = points.size(); left > 1; --left)
    for (std::size_t i = 0; i + 1 < left; ++i) points[i] = (1 - t) * points[i] + t * points[i + 1];
  return points[0];
}

Vector2d rotated(const Vector2d& v, double angle) { return Eigen::Rotation2Dd(angle) * v; }

}  // namespace

Curve::Curve(const Vector2d& start, const PatternEdge& edge) : points_{start} {
  points_.insert(points_.end(), edge.points.begin(), edge.points.end());
  const Vector2d &end = points_.back(), chord = end - start;
  if (edge.arc && points_.size() == 3) {
    const Vector2d middle = points_[1];
    points_.erase(points_.begin() + 1);
    // what the chord is seen under from the middle: half of the angle that is left of the circle
    const Vector2d a = start - middle, b = end - middle;
    const double seen = std::atan2(cross2(b, a), a.dot(b));
    constexpr double kStraight = 1e-7;  // rad
    const double rest = std::numbers::pi - std::abs(seen);
    broken_ = std::abs(seen) < kStraight;
    if (!broken_ && rest > kStraight) {
      angle_ = std::copysign(2 * rest, seen);
      const double radius = chord.norm() / 2 / std::sin(rest);
      center_ = (start + end) / 2 + Vector2d(-chord.y(), chord.x()).normalized() * radius *
                                        std::cos(rest) * (angle_ > 0 ? 1 : -1);
      length_ = radius * std::abs(angle_);
      return;
    }
  }
  if (points_.size() == 2) {
    length_ = chord.norm();
    return;
  }
  std::vector<Vector2d> slope;  // of the derivative, itself a Bezier curve
  for (std::size_t i = 0; i + 1 < points_.size(); ++i)
    slope.emplace_back(static_cast<double>(points_.size() - 1) * (points_[i + 1] - points_[i]));
  lengths_.push_back(0);
  for (int k = 0; k < kSteps; ++k) {
    double sum = 0;
    for (std::size_t n = 0; n < kNodes.size(); ++n)
      sum += kWeights[n] * bezier(slope, (k + (1 + kNodes[n]) / 2) / kSteps).norm();
    lengths_.push_back(lengths_.back() + sum / 2 / kSteps);
  }
  length_ = lengths_.back();
}

Vector2d Curve::point(double t) const {
  if (angle_ != 0) return center_ + rotated(points_[0] - center_, t * angle_);
  return bezier(points_, t);
}

double Curve::parameter(double share) const {
  if (lengths_.empty()) return share;
  const double wanted = share * length_;
  const auto above = std::upper_bound(lengths_.begin() + 1, lengths_.end() - 1, wanted);
  const double step = *above - *(above - 1);
  const double part = step > 0 ? (wanted - *(above - 1)) / step : 0;
  return (static_cast<double>(above - 1 - lengths_.begin()) + part) / kSteps;
}

Vector2d Curve::at(double share) const {
  if (share <= 0) return points_.front();
  if (share >= 1) return points_.back();
  if (angle_ != 0 && share > 0.5)  // as from its other end
    return center_ + rotated(points_.back() - center_, (share - 1) * angle_);
  return point(parameter(share));
}

double Curve::turning(double from, double to) const {
  if (angle_ != 0) return std::abs(angle_) * (to - from);
  if (lengths_.empty()) return 0;
  constexpr int kParts = 16;
  double sum = 0;
  Vector2d before = at(from), along = Vector2d::Zero();
  for (int k = 1; k <= kParts; ++k) {
    const Vector2d here = at(from + (to - from) * k / kParts), next = here - before;
    if (along.squaredNorm() > 0) sum += std::abs(std::atan2(cross2(along, next), along.dot(next)));
    before = here, along = next;
  }
  return sum * kParts / (kParts - 1);
}

std::vector<Curve> outline_of(const PatternPanel& panel) {
  std::vector<Curve> curves;
  Vector2d start = panel.edges.back().points.back();
  for (const PatternEdge& edge : panel.edges) {
    curves.emplace_back(start, edge);
    start = edge.points.back();
  }
  return curves;
}

}  // namespace weft

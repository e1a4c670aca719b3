#include "client/garments/surroundings.h"

#include <algorithm>
#include <cmath>

namespace weft::client {

double Surroundings::depth(double direction, double low, double high, double wide) const {
  double most = 0;
  for (const Vector3d& at : form_.mesh.vertices)
    if (at.y() >= low && at.y() <= high && std::abs(at.x()) <= wide)
      most = std::max(most, direction * at.z());
  return direction * most;
}

double Surroundings::top(double x) const {
  constexpr double kNear = 0.015;
  double most = 0;
  for (const Vector3d& at : form_.mesh.vertices)
    if (std::abs(at.x() - x) < kNear && at.y() < form_.neck_height + 0.04)
      most = std::max(most, at.y());
  return most;
}

double Surroundings::crotch() const {
  constexpr double kNear = 0.01;
  const double hip = form_.girth("hip").height;
  double least = hip;
  for (const Vector3d& at : form_.mesh.vertices)
    if (std::abs(at.x()) < kNear && at.y() > hip / 2) least = std::min(least, at.y());
  return least;
}

PanelPlace front_of(const Outline& outline, const Surroundings& body) {
  return {{0, 0, body.depth(1, outline.least_v(), outline.most_v(), outline.most_u()) + kClear}};
}

PanelPlace back_of(const Outline& outline, const Surroundings& body) {
  const double z = body.depth(-1, outline.least_v(), outline.most_v(), outline.most_u()) - kClear;
  return behind({}, z);
}

Outline trapezoid(const char* lower, double low, double low_half, const char* upper, double high,
                  double high_half, bool front) {
  const std::string here = front ? "left" : "right", there = front ? "right" : "left";
  Outline outline({-low_half, low});
  outline.line(lower, {low_half, low});
  outline.line(of_side("side", here).c_str(), {high_half, high});
  outline.line(upper, {-high_half, high});
  outline.line(of_side("side", there).c_str(), {-low_half, low});
  return outline;
}

Outline band_outline(double half, double low, double height, bool front) {
  return trapezoid("lower", low, half, "upper", low + height, half, front);
}

}  // namespace weft::client

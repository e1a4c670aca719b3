#include "client/render/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace weft::client {
namespace {

using Eigen::Vector3d;

constexpr double kHalfAngle = 16;  // of view, upwards, degrees
constexpr double kUsed = 0.92;     // of the picture's width, and of what the margins leave

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

}  // namespace

Directions directions_of(const Vector3d& gravity, const Outlook& outlook) {
  const double length = gravity.norm();
  const Vector3d up = length > 0 ? Vector3d(-gravity / length) : Vector3d::UnitY();
  Vector3d front = std::abs(up.z()) > 0.9 ? Vector3d(0, -1, 0) : Vector3d(0, 0, 1);
  front = (front - front.dot(up) * up).normalized();
  const Vector3d right = up.cross(front);
  const double angle = radians(outlook.azimuth);
  return {up, std::cos(angle) * front + std::sin(angle) * right,
          std::cos(angle) * right - std::sin(angle) * front};
}

CameraFit::CameraFit(const Directions& directions, const Outlook& outlook, double aspect,
                     const Margins& margins) {
  const double angle = radians(outlook.elevation);
  camera_.forward = -std::cos(angle) * directions.near - std::sin(angle) * directions.up;
  camera_.right = directions.right;
  camera_.up = camera_.right.cross(camera_.forward);
  camera_.tangent_y = std::tan(radians(kHalfAngle));
  camera_.tangent_x = camera_.tangent_y * aspect;
  left_.tangent = right_.tangent = kUsed * camera_.tangent_x;
  above_.tangent = kUsed * (1 - 2 * margins.top) * camera_.tangent_y;
  below_.tangent = kUsed * (1 - 2 * margins.bottom) * camera_.tangent_y;
}

void CameraFit::add(const Ball& ball) {
  const double depth = ball.centre.dot(camera_.forward);
  const auto reach = [&](Side& side, double across) {
    side.most = std::max(side.most,
                         across - side.tangent * depth + ball.radius * std::hypot(1, side.tangent));
  };
  reach(right_, ball.centre.dot(camera_.right));
  reach(left_, -ball.centre.dot(camera_.right));
  reach(above_, ball.centre.dot(camera_.up));
  reach(below_, -ball.centre.dot(camera_.up));
}

// From a place at (x, y) across and z along the view, the right edge is beyond everything where
// x - tangent z >= most; with the left one, -(tangents) z >= both; and so upwards.
Camera CameraFit::camera() const {
  const auto depth = [](const Side& a, const Side& b) {
    return -(a.most + b.most) / (a.tangent + b.tangent);
  };
  const auto middle = [](const Side& a, const Side& b, double z) {
    return (a.most + a.tangent * z - b.most - b.tangent * z) / 2;
  };
  const double z = std::min(depth(right_, left_), depth(above_, below_));
  Camera camera = camera_;
  camera.place = middle(right_, left_, z) * camera.right + middle(above_, below_, z) * camera.up +
                 z * camera.forward;
  return camera;
}

}  // namespace weft::client

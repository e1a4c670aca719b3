#include "core/contact/contact.h"

#include <algorithm>
#include <cmath>

namespace weft {
namespace {

// Distance from the surface of a ball of `radius` around `center`.
Distance distance_from_ball(const Vector3d& center, double radius, const Vector3d& point) {
  const Vector3d away = point - center;
  const double length = away.norm();
  return {length - radius, length > 0 ? Vector3d(away / length) : Vector3d(Vector3d::UnitY())};
}

Distance distance_at(const Collider& collider, const Vector3d& offset, const Vector3d& point) {
  return std::visit([&](const auto& shape) { return distance(shape, point - offset); },
                    collider.shape);
}

}  // namespace

Distance distance(const Plane& plane, const Vector3d& point) {
  const Vector3d normal = plane.normal.normalized();
  return {(point - plane.point).dot(normal), normal};
}

Distance distance(const Sphere& sphere, const Vector3d& point) {
  return distance_from_ball(sphere.center, sphere.radius, point);
}

Distance distance(const Box& box, const Vector3d& point) {
  const Quaterniond rotation = box.rotation.normalized();
  const Vector3d local = rotation.conjugate() * (point - box.center);
  const Vector3d beyond = local.cwiseAbs() - box.half_size;  // positive outside a face
  const Vector3d side = local.unaryExpr([](double v) { return v < 0 ? -1.0 : 1.0; });
  const Vector3d outside = beyond.cwiseMax(0);
  const double length = outside.norm();
  if (length > 0) return {length, rotation * side.cwiseProduct(outside / length)};
  Eigen::Index face = 0;
  const double inside = beyond.maxCoeff(&face);
  return {inside, rotation * Vector3d(side[face] * Vector3d::Unit(face))};
}

Distance distance(const Capsule& capsule, const Vector3d& point) {
  const Vector3d axis = capsule.end - capsule.start;
  const double squared = axis.squaredNorm();
  const double along =
      squared > 0 ? std::clamp((point - capsule.start).dot(axis) / squared, 0.0, 1.0) : 0;
  return distance_from_ball(capsule.start + along * axis, capsule.radius, point);
}

Distance distance(const Collider& collider, const Vector3d& point, double time) {
  return distance_at(collider, offset_at(collider.path, time), point);
}

Contacts::Contacts(std::span<const Collider> colliders, double friction, double skin, double time,
                   double dt)
    : skin_(skin) {
  placed_.reserve(colliders.size());
  for (const Collider& collider : colliders) {
    const Vector3d offset = offset_at(collider.path, time);
    const Vector3d carried = offset - offset_at(collider.path, time - dt);
    const auto* box = std::get_if<Box>(&collider.shape);
    placed_.push_back({collider,
                       box != nullptr ? box->rotation.normalized().toRotationMatrix()
                                      : Eigen::Matrix3d::Identity().eval(),
                       offset, carried, std::sqrt(friction * collider.friction)});
    reach_ = std::max(reach_, carried.norm());
  }
}

bool Contacts::resolve(Vector3d& x, Vector3d& d) const {
  bool touched = false;
  for (int round = 0; round < kRounds; ++round) {
    double deepest = 0;
    for (const auto& [collider, turn, offset, carried, mu] : placed_) {
      const auto [value, normal] = distance_at(collider, offset, x);
      if (!(value < skin_)) continue;
      touched = true;
      const double depth = skin_ - value;
      deepest = std::max(deepest, depth);
      const Vector3d relative = d - carried;
      const double approach = relative.dot(normal);

      // out to the skin; the push takes away approach but never adds speed
      x += depth * normal;
      const double push = std::clamp(-approach, 0.0, depth);
      d += push * normal;

      // Coulomb: the push bounds how much sliding it can stop, not the depth, which on a curved
      // body differs from it by how far the surface falls away
      const Vector3d sliding = relative - approach * normal;
      const double length = sliding.norm();
      if (length == 0) continue;
      const Vector3d stopped = std::min(1.0, mu * push / length) * sliding;
      x -= stopped;
      d -= stopped;
    }
    if (deepest <= kNothing || placed_.size() == 1) break;
  }
  return touched;
}

}  // namespace weft

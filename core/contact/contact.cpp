#include "core/contact/contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Where a body is thinnest, m.
double thickness(const Plane&) { return kInfinite; }
double thickness(const Sphere& sphere) { return 2 * sphere.radius; }
double thickness(const Box& box) { return 2 * box.half_size.minCoeff(); }
double thickness(const Capsule& capsule) { return 2 * capsule.radius; }

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
    : skin_(skin), thinnest_(kInfinite) {
  placed_.reserve(colliders.size());
  for (const Collider& collider : colliders) {
    const Vector3d offset = offset_at(collider.path, time);
    const Vector3d carried = offset - offset_at(collider.path, time - dt);
    const auto* box = std::get_if<Box>(&collider.shape);
    placed_.push_back(
        {collider,
         box != nullptr ? box->rotation.normalized().toRotationMatrix()
                        : Eigen::Matrix3d::Identity().eval(),
         offset, carried, std::sqrt(friction * collider.friction),
         std::visit([](const auto& shape) { return thickness(shape); }, collider.shape) +
             2 * skin});
    reach_ = std::max(reach_, carried.norm());
    thinnest_ = std::min(thinnest_, placed_.back().thickness);
  }
}

double Contacts::gap(const Vector3d& x) const {
  double least = kInfinite;
  for (const Placed& each : placed_)
    least = std::min(least, distance_at(each.collider, each.offset, x).value - skin_);
  return least;
}

// Of the step, for a particle that could have met a collider in it.
int Contacts::parts(const Vector3d& x, const Vector3d& d) const {
  constexpr double kMost = 1e4;
  double most = 1;
  for (const Placed& each : placed_) {
    const double relative = (d - each.carried).norm();
    const double needed = kParts * relative / each.thickness;
    if (needed > most && distance_at(each.collider, each.offset, x).value - skin_ < relative)
      most = needed;
  }
  return static_cast<int>(std::ceil(std::min(most, kMost)));
}

bool Contacts::resolve(Vector3d& x, Vector3d& d) const {
  const int count = parts(x, d);
  if (count == 1) return push_out(x, d, 0, 1);
  Vector3d at = x - d, part = d / count;
  bool touched = false;
  for (int left = count - 1; left >= 0; --left) {
    at += part;
    touched |= push_out(at, part, double(left) / count, 1.0 / count);
  }
  if (!touched) return false;
  x = at;
  d = count * part;
  return true;
}

bool Contacts::push_out(Vector3d& x, Vector3d& d, double left, double share) const {
  bool touched = false;
  for (int round = 0; round < kRounds; ++round) {
    double deepest = 0;
    for (const Placed& each : placed_) {
      const Vector3d offset = each.offset - left * each.carried;
      const auto [value, normal] = distance_at(each.collider, offset, x);
      if (!(value < skin_)) continue;
      touched = true;
      const double depth = skin_ - value;
      deepest = std::max(deepest, depth);
      const Vector3d relative = d - share * each.carried;
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
      const Vector3d stopped = std::min(1.0, each.friction * push / length) * sliding;
      x -= stopped;
      d -= stopped;
    }
    if (deepest <= kNothing || placed_.size() == 1) break;
  }
  return touched;
}

}  // namespace weft

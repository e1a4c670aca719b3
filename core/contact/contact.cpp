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

// A collider during one step.
struct Placed {
  const Collider& collider;
  Vector3d offset;   // from its start, m
  Vector3d carried;  // its displacement in the step, m
  double friction;   // between it and the textile
};

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

void resolve_contacts(std::span<const Collider> colliders, double friction, double skin,
                      double time, double dt, const VectorXd& inverse_mass, Matrix3Xd& x,
                      Matrix3Xd& d) {
  std::vector<Placed> placed;
  placed.reserve(colliders.size());
  for (const Collider& collider : colliders) {
    const Vector3d offset = offset_at(collider.path, time);
    placed.push_back({collider, offset, offset - offset_at(collider.path, time - dt),
                      std::sqrt(friction * collider.friction)});
  }

  // a body may push a particle into another one: rounds go on until one moves it no further
  constexpr int kRounds = 32;
  constexpr double kNothing = 1e-12;  // m
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    if (inverse_mass[i] == 0) continue;
    for (int round = 0; round < kRounds; ++round) {
      double deepest = 0;
      for (const auto& [collider, offset, carried, mu] : placed) {
        const auto [value, normal] = distance_at(collider, offset, x.col(i));
        if (!(value < skin)) continue;
        const double depth = skin - value;
        deepest = std::max(deepest, depth);
        const Vector3d relative = d.col(i) - carried;
        const double approach = relative.dot(normal);

        // out to the skin; the push takes away approach but never adds speed
        x.col(i) += depth * normal;
        d.col(i) += std::clamp(-approach, 0.0, depth) * normal;

        // Coulomb: the push bounds how much sliding it can stop
        const Vector3d sliding = relative - approach * normal;
        const double length = sliding.norm();
        if (length == 0) continue;
        const Vector3d stopped = std::min(1.0, mu * depth / length) * sliding;
        x.col(i) -= stopped;
        d.col(i) -= stopped;
      }
      if (deepest <= kNothing || placed.size() == 1) break;
    }
  }
}

}  // namespace weft

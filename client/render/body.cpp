#include "client/render/body.h"

#include <algorithm>
#include <limits>
#include <string_view>

#include "client/exports/normals.h"
#include "client/message_values.h"

namespace weft::client {
namespace {

using Eigen::Vector3d;

// How far a path leads by then.
Vector3d offset_at(const google::protobuf::RepeatedPtrField<v1::Keyframe>& path, double time_s) {
  if (path.empty()) return Vector3d::Zero();
  const auto next = std::find_if(path.begin(), path.end(),
                                 [&](const v1::Keyframe& key) { return time_s < key.time_s(); });
  if (next == path.begin()) return vector_of(next->offset_m());
  const v1::Keyframe& before = *std::prev(next);
  Vector3d from = vector_of(before.offset_m());
  if (next == path.end()) return from;
  const double share = (time_s - before.time_s()) / (next->time_s() - before.time_s());
  return from + share * (vector_of(next->offset_m()) - from);
}

// Planes x, y, z of the vertices at that time.
std::vector<float> positions_at(const v1::MeshData& mesh, double time_s) {
  const auto& times = mesh.poses().times_s();
  if (times.empty()) return values_of<float>(mesh.positions_m());
  const std::string_view all = mesh.poses().positions_m();
  const std::size_t size = all.size() / static_cast<std::size_t>(times.size());
  const auto pose = [&](std::ptrdiff_t p) {
    return values_of<float>(all.substr(static_cast<std::size_t>(p) * size, size));
  };
  const std::ptrdiff_t next = std::upper_bound(times.begin(), times.end(), time_s) - times.begin();
  std::vector<float> from = pose(std::max(next - 1, std::ptrdiff_t{0}));
  if (next == 0 || next == times.size()) return from;
  const double before = times[static_cast<int>(next - 1)];
  const auto share =
      static_cast<float>((time_s - before) / (times[static_cast<int>(next)] - before));
  const std::vector<float> to = pose(next);
  for (std::size_t i = 0; i < from.size(); ++i) from[i] += share * (to[i] - from[i]);
  return from;
}

Vector3d direction_of(const Vector3d& vector, const Vector3d& otherwise) {
  const double length = vector.norm();
  return length > 0 ? Vector3d(vector / length) : otherwise;
}

Solid solid_of(const v1::MeshData& mesh, const Vector3d& offset, double pose_time_s) {
  Solid solid;
  solid.offset = offset;
  const std::vector<float> planes = positions_at(mesh, pose_time_s);
  const std::size_t count = planes.size() / 3;
  const auto plane = [&](std::size_t axis) {
    const auto first = planes.begin() + static_cast<std::ptrdiff_t>(axis * count);
    return std::vector<double>(first, first + static_cast<std::ptrdiff_t>(count));
  };
  solid.corners = {plane(0), plane(1), plane(2)};
  solid.triangles = values_of<std::uint32_t>(mesh.triangles());
  if (std::any_of(solid.triangles.begin(), solid.triangles.end(),
                  [&](std::uint32_t i) { return i >= count; }))
    solid.triangles.clear();
  solid.triangles.resize(solid.triangles.size() / 3 * 3);
  solid.normals = normals_of(solid.corners, solid.triangles);
  return solid;
}

// pose_time_s: among the times of its poses.
Body body_of(const v1::Collider& collider, const Vector3d& offset, double pose_time_s) {
  switch (collider.shape_case()) {
    case v1::Collider::kSphere:
      return Ball{vector_of(collider.sphere().center_m()) + offset, collider.sphere().radius_m()};
    case v1::Collider::kCapsule: {
      const v1::Capsule& capsule = collider.capsule();
      return Capsule{vector_of(capsule.start_m()) + offset, vector_of(capsule.end_m()) + offset,
                     capsule.radius_m()};
    }
    case v1::Collider::kBox: {
      const v1::Box& box = collider.box();
      return Cuboid{vector_of(box.center_m()) + offset, vector_of(box.half_size_m()),
                    rotation_of(box)};
    }
    case v1::Collider::kMesh:
      return solid_of(collider.mesh().data(), offset, pose_time_s);
    default: {
      const v1::Plane& plane = collider.plane();
      return HalfSpace{vector_of(plane.point_m()) + offset,
                       direction_of(vector_of(plane.normal()), Vector3d::UnitY())};
    }
  }
}

Way way_from(const Ball& ball, const Vector3d& place, double /*rounding*/) {
  const Vector3d from = place - ball.centre;
  return {from.norm() - ball.radius, direction_of(from, Vector3d::UnitY())};
}

Way way_from(const Capsule& capsule, const Vector3d& place, double /*rounding*/) {
  const Vector3d axis = capsule.end - capsule.start;
  const double square = axis.squaredNorm();
  const double along = square > 0 ? (place - capsule.start).dot(axis) / square : 0;
  return way_from(Ball{capsule.start + std::clamp(along, 0.0, 1.0) * axis, capsule.radius}, place,
                  0);
}

Way way_from(const Cuboid& box, const Vector3d& place, double rounding) {
  const Vector3d local = box.rotation.conjugate() * (place - box.centre);
  const Vector3d outside = local - local.cwiseMax(-box.half_size).cwiseMin(box.half_size);
  if (!outside.isZero(0))
    return {outside.norm(), box.rotation * Vector3d(outside / outside.norm())};

  // away from the box that is smaller by the rounding
  const Vector3d inner = (box.half_size.array() - rounding).max(0);
  const Vector3d away = local - local.cwiseMax(-inner).cwiseMin(inner);
  Vector3d direction = away.normalized();
  if (rounding == 0 || away.isZero(0)) {
    Eigen::Index axis = 0;
    (box.half_size - local.cwiseAbs()).minCoeff(&axis);
    direction = Vector3d::Unit(axis) * (local[axis] < 0 ? -1 : 1);
  }
  double depth = std::numeric_limits<double>::infinity();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double slope = std::abs(direction[axis]);
    if (slope > 0) depth = std::min(depth, (box.half_size[axis] - std::abs(local[axis])) / slope);
  }
  return {-depth, box.rotation * direction};
}

Way way_from(const Solid& /*solid*/, const Vector3d& /*place*/, double /*rounding*/) {
  return {std::numeric_limits<double>::infinity(), Vector3d::UnitY()};
}

Way way_from(const HalfSpace& space, const Vector3d& place, double /*rounding*/) {
  return {(place - space.point).dot(space.normal), space.normal};
}

}  // namespace

std::vector<Body> bodies_at(const v1::Scene& scene, double time_s,
                            const std::vector<double>& pose_times_s) {
  std::vector<Body> bodies;
  auto led = pose_times_s.begin();
  for (const auto& collider : scene.colliders()) {
    const bool is_led = collider.mesh().data().has_poses() && led != pose_times_s.end();
    bodies.push_back(
        body_of(collider, offset_at(collider.path(), time_s), is_led ? *led++ : time_s));
  }
  return bodies;
}

Way way_out(const Body& body, const Vector3d& place, double rounding) {
  return std::visit([&](const auto& shape) { return way_from(shape, place, rounding); }, body);
}

std::vector<Ball> hull_of(const Body& body) {
  if (const auto* ball = std::get_if<Ball>(&body)) return {*ball};
  if (const auto* capsule = std::get_if<Capsule>(&body))
    return {{capsule->start, capsule->radius}, {capsule->end, capsule->radius}};
  std::vector<Ball> corners;
  if (const auto* solid = std::get_if<Solid>(&body)) {
    const Points& at = solid->corners;
    for (std::size_t i = 0; i < at.x.size(); ++i)
      corners.push_back({Vector3d(at.x[i], at.y[i], at.z[i]) + solid->offset, 0});
  }
  if (const auto* box = std::get_if<Cuboid>(&body)) {
    for (int k = 0; k < 8; ++k) {
      const Vector3d signs(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
      corners.push_back({box->centre + box->rotation * box->half_size.cwiseProduct(signs), 0});
    }
  }
  return corners;
}

}  // namespace weft::client

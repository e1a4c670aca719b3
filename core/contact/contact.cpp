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
constexpr double kLeastThickness = 1e-3;  // of what is left of a deflated body, m

// Where a body is thinnest, m.
double thickness(const Plane&) { return kInfinite; }
double thickness(const Sphere& sphere) { return 2 * sphere.radius; }
double thickness(const Box& box) { return 2 * box.half_size.minCoeff(); }
double thickness(const Capsule& capsule) { return 2 * capsule.radius; }
// What is thinner than a cell is not in the grid.
double thickness(const SharedBody& body) { return std::max(body->thickness, body->grid.cell); }

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

Distance distance(const SharedBody& body, const Vector3d& point) {
  const DistanceGrid& grid = body->grid;
  constexpr int kBlock = DistanceGrid::kBlock;
  const double edge = kBlock * grid.cell;

  // the block, and where in it
  const Vector3d most(grid.blocks[0], grid.blocks[1], grid.blocks[2]);
  const Vector3d at = (point - grid.low) * (1 / edge);
  const Vector3d inside =
      at.binaryExpr(most, [](double v, double end) { return v > 0 ? std::min(v, end) : 0; });
  const Vector3d block = inside.array().floor().min(most.array() - 1);
  const auto index =
      static_cast<std::size_t>((block.z() * most.y() + block.y()) * most.x() + block.x());
  const std::int32_t begin = grid.begin[index];
  const int cells = begin < 0 ? 1 : kBlock;
  const Vector3d in_block = (inside - block) * cells;
  const Vector3d cell = in_block.array().floor().min(cells - 1);
  const Vector3d share = in_block - cell;

  // values at the corners of the cell, and between them
  const int row = cells + 1, layer = row * row;
  const float* const first = grid.values.data() + (begin < 0 ? ~begin : begin) +
                             static_cast<int>(cell.z()) * layer + static_cast<int>(cell.y()) * row +
                             static_cast<int>(cell.x());
  const auto between = [](double a, double b, double s) { return a + (b - a) * s; };
  double x[2][2], dx[2][2], y[2], dxy[2], dy[2];
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 2; ++j) {
      const float* const v = first + k * layer + j * row;
      dx[k][j] = double{v[1]} - double{v[0]};
      x[k][j] = double{v[0]} + dx[k][j] * share.x();
    }
    dy[k] = x[k][1] - x[k][0];
    y[k] = x[k][0] + dy[k] * share.y();
    dxy[k] = between(dx[k][0], dx[k][1], share.y());
  }
  const double value = between(y[0], y[1], share.z());
  const Vector3d gradient(between(dxy[0], dxy[1], share.z()), between(dy[0], dy[1], share.z()),
                          y[1] - y[0]);
  const double length = gradient.norm();
  const Vector3d normal = length > 0 ? Vector3d(gradient / length) : Vector3d(Vector3d::UnitY());
  const double beyond = (at - inside).norm() * edge;
  return {beyond > 0 ? grid.reach + beyond : value, normal};
}

Distance distance(const Collider& collider, const Vector3d& point, double time) {
  return distance_at(collider, offset_at(collider.path, time), point);
}

Contacts::Contacts(std::span<const Collider> colliders, double friction, double skin, double time,
                   double dt, double deflate, double growth)
    : skin_(skin - deflate), thinnest_(kInfinite) {
  placed_.reserve(colliders.size());
  for (const Collider& collider : colliders) {
    const Vector3d offset = offset_at(collider.path, time);
    const Vector3d carried = offset - offset_at(collider.path, time - dt);
    const auto* box = std::get_if<Box>(&collider.shape);
    const double thick =
        std::visit([](const auto& shape) { return thickness(shape); }, collider.shape) + 2 * skin_;
    const bool of_triangles = std::holds_alternative<SharedBody>(collider.shape);
    placed_.push_back({collider,
                       box != nullptr ? box->rotation.normalized().toRotationMatrix()
                                      : Eigen::Matrix3d::Identity().eval(),
                       offset, carried, std::sqrt(friction * collider.friction),
                       deflate > 0 ? std::max(thick, kLeastThickness) : thick,
                       of_triangles ? DistanceGrid::kSteepest : 1,
                       of_triangles ? kOutward * dt : kInfinite});
    reach_ = std::max(reach_, carried.norm() + growth);
    thinnest_ = std::min(thinnest_, placed_.back().thickness);
  }
}

double Contacts::gap(const Vector3d& x) const {
  double least = kInfinite;
  for (const Placed& each : placed_)
    least =
        std::min(least, (distance_at(each.collider, each.offset, x).value - skin_) / each.steepest);
  return least;
}

// Of the step, for a particle that could have met a collider in it.
int Contacts::parts(const Vector3d& x, const Vector3d& d) const {
  constexpr double kMost = 1e4;
  double most = 1;
  for (const Placed& each : placed_) {
    const double relative = (d - each.carried).norm();
    const double needed = kParts * relative / each.thickness;
    if (needed > most &&
        distance_at(each.collider, each.offset, x).value - skin_ < each.steepest * relative)
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
  double pushed = 0;
  for (int round = 0; round < kRounds; ++round) {
    double deepest = 0;
    for (const Placed& each : placed_) {
      const Vector3d offset = each.offset - left * each.carried;
      const auto [value, normal] = distance_at(each.collider, offset, x);
      if (!(value < skin_)) continue;
      touched = true;
      const Vector3d relative = d - share * each.carried;
      const double approach = relative.dot(normal);
      const double most = std::max(-approach, 0.0) + pushed + share * each.creep;
      const double depth = std::min(skin_ - value, most);
      pushed += depth;
      deepest = std::max(deepest, depth);

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

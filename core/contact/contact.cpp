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

// Where a point is in a grid.
struct InGrid {
  std::size_t first;  // value of its cell
  int row, layer;     // from there to the next ones
  Vector3d share;     // of the cell
  double beyond;      // how far it is from the grid, m
};

InGrid locate(const DistanceGrid& grid, const Vector3d& point) {
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

  const int row = cells + 1, layer = row * row;
  const int first = (begin < 0 ? ~begin : begin) + static_cast<int>(cell.z()) * layer +
                    static_cast<int>(cell.y()) * row + static_cast<int>(cell.x());
  return {static_cast<std::size_t>(first), row, layer, in_block - cell,
          (at - inside).norm() * edge};
}

struct Between {
  double value;
  Vector3d slope;
};

// Between the values at the corners of a cell.
Between between_corners(const std::vector<float>& values, const InGrid& at) {
  const auto between = [](double a, double b, double s) { return a + (b - a) * s; };
  double x[2][2], dx[2][2], y[2], dxy[2], dy[2];
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 2; ++j) {
      const float* const v = values.data() + at.first + k * at.layer + j * at.row;
      dx[k][j] = double{v[1]} - double{v[0]};
      x[k][j] = double{v[0]} + dx[k][j] * at.share.x();
    }
    dy[k] = x[k][1] - x[k][0];
    y[k] = x[k][0] + dy[k] * at.share.y();
    dxy[k] = between(dx[k][0], dx[k][1], at.share.y());
  }
  return {
      between(y[0], y[1], at.share.z()),
      {between(dxy[0], dxy[1], at.share.z()), between(dy[0], dy[1], at.share.z()), y[1] - y[0]}};
}

Vector3d direction(const Vector3d& v) {
  const double length = v.norm();
  return length > 0 ? Vector3d(v / length) : Vector3d(Vector3d::UnitY());
}

Distance distance(const DistanceGrid& grid, const Vector3d& point) {
  const InGrid at = locate(grid, point);
  const auto [value, slope] = between_corners(grid.values, at);
  return {at.beyond > 0 ? grid.reach + at.beyond : value, direction(slope)};
}

// point: from the middle. change: of the value from one grid to the other.
Distance distance(const PosedBody& body, double share, const Vector3d& point,
                  double* change = nullptr) {
  const Distance from = distance(body.from->distances, point),
                 to = distance(body.to->distances, point);
  if (change != nullptr) *change = to.value - from.value;
  return {from.value + (to.value - from.value) * share,
          direction(from.normal + (to.normal - from.normal) * share)};
}

// Before its end by `left` of the step.
Distance distance_at(const Contacts::Placed& placed, double left, const Vector3d& x,
                     double* change = nullptr) {
  const Vector3d point = x - (placed.offset - left * placed.carried);
  if (const PosedBody* posed = placed.posed)
    return distance(*posed, posed->share - left * posed->step, point, change);
  return std::visit([&](const auto& shape) { return distance(shape, point); },
                    placed.collider.shape);
}

// Displacement of the surface near x in the step. What leads out is as the distance changes.
Vector3d carried_at(const Contacts::Placed& placed, double left, const Vector3d& x,
                    const Vector3d& normal, double change) {
  const PosedBody* posed = placed.posed;
  if (posed == nullptr) return placed.carried;
  const InGrid at = locate(posed->from->distances, x - (placed.offset - left * placed.carried));
  Vector3d way;
  for (std::size_t axis = 0; axis < 3; ++axis)
    way[static_cast<Eigen::Index>(axis)] = between_corners(posed->from->ways[axis], at).value;
  way -= (way.dot(normal) + change) * normal;
  return placed.carried + posed->step * way;
}

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kLeastThickness = 1e-3;  // of what is left of a deflated body, m
constexpr double kMostCells = 4;          // of the thickness of a body between poses

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
  return distance(body->grid, point);
}

Distance distance(const Collider& collider, const Vector3d& point, double time,
                  const PosedBody* posed) {
  const Vector3d at = point - offset_at(collider.path, time);
  if (posed != nullptr) return distance(*posed, posed->share, at - posed->offset);
  return std::visit([&](const auto& shape) { return distance(shape, at); }, collider.shape);
}

Contacts::Contacts(std::span<const Collider> colliders, const MovingBodies& bodies, double friction,
                   double skin, double time, double dt, double deflate, double growth,
                   double pressed)
    : skin_(skin - deflate), thinnest_(kInfinite) {
  placed_.reserve(colliders.size());
  for (const Collider& collider : colliders) {
    Vector3d offset = offset_at(collider.path, time);
    Vector3d carried = offset - offset_at(collider.path, time - dt);
    double moved = carried.norm();
    const PosedBody* posed = bodies.of(placed_.size());
    if (posed != nullptr) {
      offset += posed->offset;
      carried += posed->carried;
      moved += posed->moved;
    }
    const auto* box = std::get_if<Box>(&collider.shape);
    double thick =
        std::visit([](const auto& shape) { return thickness(shape); }, collider.shape) + 2 * skin_;
    if (posed != nullptr)  // it may be thinner than in its first pose
      thick = std::min(thick, kMostCells * std::get<SharedBody>(collider.shape)->grid.cell);
    const bool of_triangles = std::holds_alternative<SharedBody>(collider.shape);
    placed_.push_back({collider,
                       box != nullptr ? box->rotation.normalized().toRotationMatrix()
                                      : Eigen::Matrix3d::Identity().eval(),
                       offset, carried, std::sqrt(friction * collider.friction),
                       deflate > 0 ? std::max(thick, kLeastThickness) : thick,
                       of_triangles ? DistanceGrid::kSteepest : 1,
                       of_triangles ? kOutward * dt + pressed : kInfinite, posed});
    reach_ = std::max(reach_, moved + growth);
    thinnest_ = std::min(thinnest_, placed_.back().thickness);
  }
}

Distance Contacts::nearest(const Vector3d& x) const {
  Distance nearest{kInfinite, Vector3d::UnitY()};
  for (const Placed& each : placed_) {
    const auto [value, normal] = distance_at(each, 0, x);
    if (const double gap = (value - skin_) / each.steepest; gap < nearest.value)
      nearest = {gap, normal};
  }
  return nearest;
}

double Contacts::gap(const Vector3d& x) const {
  double least = kInfinite;
  for (const Placed& each : placed_) {
    const double value = distance_at(each, 0, x).value;
    double beyond = value - skin_;
    if (jumps(each)) beyond = std::min(beyond, std::max(value, 0.0));
    least = std::min(least, beyond / each.steepest);
  }
  return least;
}

// Of the step, for a particle that could have met a collider in it.
int Contacts::parts(const Vector3d& x, const Vector3d& d) const {
  constexpr double kMost = 1e4;
  double most = 1;
  for (const Placed& each : placed_) {
    const double relative =
        (d - each.carried).norm() + (each.posed != nullptr ? each.posed->moved : 0);
    const double needed = kParts * relative / each.thickness;
    if (needed > most && distance_at(each, 0, x).value - skin_ < each.steepest * relative)
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
      double change = 0;
      const auto [value, normal] = distance_at(each, left, x, &change);
      if (!(value < skin_)) continue;
      touched = true;
      const Vector3d relative = d - share * carried_at(each, left, x, normal, change);
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

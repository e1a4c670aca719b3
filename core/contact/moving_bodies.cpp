#include "core/contact/moving_bodies.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace weft {
namespace {

constexpr std::size_t kKept = 3;  // grids

// Grids from a pose to the next.
int parts_of(const Poses& poses, std::size_t pose, double cell) {
  constexpr double kMost = 1e6;
  return pose < poses.own_ways.size()
             ? static_cast<int>(std::clamp(std::ceil(poses.own_ways[pose] / cell), 1.0, kMost))
             : 1;
}

// Whether it keeps its shape from a pose to the next.
bool is_still(const Poses& poses, std::size_t pose) {
  return pose >= poses.own_ways.size() || poses.own_ways[pose] == 0;
}

// Whether the grid of the pose before is its own, too.
bool shares_grid(const Poses& poses, std::size_t pose) {
  return pose > 0 && is_still(poses, pose) && is_still(poses, pose - 1);
}

// Around its middle.
Vector3d place_at(const Poses& poses, std::size_t pose, double share, std::size_t vertex) {
  Vector3d at = poses.position(pose, vertex) - poses.middles[pose];
  if (share > 0) at += share * (poses.position(pose + 1, vertex) - poses.middles[pose + 1] - at);
  return at;
}

Vector3d middle_at(const Poses& poses, std::size_t pose, double time) {
  const double share = (time - poses.times[pose]) / (poses.times[pose + 1] - poses.times[pose]);
  return poses.middles[pose] + share * (poses.middles[pose + 1] - poses.middles[pose]);
}

}  // namespace

MovingBodies::MovingBodies(std::span<const Collider> colliders) {
  for (std::size_t c = 0; c < colliders.size(); ++c)
    if (colliders[c].poses)
      bodies_[c] = {colliders[c].poses, std::get<SharedBody>(colliders[c].shape), {}, false, {}};
}

void MovingBodies::place(std::span<const Collider> colliders, double time, double dt) {
  for (auto& [collider, moving] : bodies_)
    place(moving, pose_time(colliders[collider], time - dt), pose_time(colliders[collider], time));
}

const PosedBody* MovingBodies::of(std::size_t collider) const {
  const auto found = bodies_.find(collider);
  return found != bodies_.end() && found->second.is_posed ? &found->second.placed : nullptr;
}

void MovingBodies::release_memory() {
  for (auto& [collider, moving] : bodies_) {
    moving.placed = {};
    moving.grids.clear();
  }
}

void MovingBodies::place(Moving& moving, double begin, double end) {
  const Poses& poses = *moving.poses;
  const double first = poses.times.front(), last = poses.times.back();
  begin = std::clamp(begin, first, last);
  end = std::clamp(end, first, last);
  moving.is_posed = std::max(begin, end) > first;
  if (!moving.is_posed) return;
  PosedBody& placed = moving.placed;
  if (begin == last && end == last) {
    const At at{poses.times.size() - 1, 0};
    placed.from = placed.to = grid(moving, at);
    placed.share = placed.step = placed.moved = 0;
    placed.offset = poses.middles.back();
    placed.carried.setZero();
    return;
  }
  // where it ends at a pose, it is on the way that it came
  const auto before = [&](auto next) {
    return static_cast<std::size_t>(next - poses.times.begin()) - 1;
  };
  const auto& times = poses.times;
  const std::size_t pose = before(begin > end ? std::upper_bound(times.begin(), times.end(), end)
                                              : std::lower_bound(times.begin(), times.end(), end));
  const int parts = parts_of(poses, pose, moving.body->grid.cell);
  const double length = (poses.times[pose + 1] - poses.times[pose]) / parts;  // s
  const double at = (end - poses.times[pose]) / length;
  const int part = std::min(static_cast<int>(at), parts - 1);
  placed.from = grid(moving, {pose, part});
  placed.to = part + 1 < parts ? grid(moving, {pose, part + 1}) : grid(moving, {pose + 1, 0});
  placed.share = at - part;
  placed.step = (end - begin) / length;
  placed.offset = middle_at(poses, pose, end);
  placed.carried = placed.offset - middle_at(poses, pose, begin);
  placed.moved = 0;
  const double low = std::min(begin, end), high = std::max(begin, end);
  const std::size_t latest = before(std::lower_bound(times.begin(), times.end(), high));
  for (std::size_t p = latest + 1; p-- > 0 && times[p + 1] > low;) {
    const double middle = (poses.middles[p + 1] - poses.middles[p]).norm();
    const double time_in = std::min(high, times[p + 1]) - std::max(low, times[p]);
    placed.moved += (middle + poses.own_ways[p]) * time_in / (poses.times[p + 1] - poses.times[p]);
  }
}

std::shared_ptr<const PoseGrid> MovingBodies::grid(Moving& moving, At at) {
  const Poses& poses = *moving.poses;
  // where it keeps its shape, one is enough
  while (at.second == 0 && shares_grid(poses, at.first)) --at.first;
  const auto known = moving.grids.find(at);
  if (known != moving.grids.end()) return known->second;
  const double cell = moving.body->grid.cell;
  const int parts = parts_of(poses, at.first, cell);
  const double share = static_cast<double>(at.second) / parts;
  BodyMesh mesh{{}, moving.body->mesh.triangles};
  std::vector<Vector3d> ways(poses.vertices(), Vector3d::Zero());
  for (std::size_t v = 0; v < poses.vertices(); ++v) {
    mesh.vertices.push_back(place_at(poses, at.first, share, v));
    if (at.first + 1 < poses.times.size())
      ways[v] = (place_at(poses, at.first, 1, v) - place_at(poses, at.first, 0, v)) / parts;
  }
  // as far as a step of a grid brings what is within the body's reach
  auto made = std::make_shared<const PoseGrid>(
      make_pose_grid(mesh, ways, cell, moving.body->grid.reach + cell));
  // what comes before is not needed any more, unless time goes back
  while (moving.grids.size() >= kKept)
    moving.grids.erase(moving.grids.begin()->first < at ? moving.grids.begin()
                                                        : std::prev(moving.grids.end()));
  return moving.grids[at] = std::move(made);
}

std::int64_t count_grids(const Poses& poses, double cell) {
  std::int64_t count = 0;
  for (std::size_t pose = 0; pose < poses.times.size(); ++pose)
    count += parts_of(poses, pose, cell) - (shares_grid(poses, pose) ? 1 : 0);
  return count;
}

double least_pose_cell(const Poses& poses, const std::vector<std::array<int, 3>>& triangles) {
  // a surface of so many squares of a cell has grids of some 80 MB
  constexpr double kMostSquares = 2e5, kMostBlocks = 2e6, kMostScanned = 1e8;
  double least = 0;
  for (std::size_t p = 0; p < poses.times.size(); ++p) {
    Eigen::AlignedBox3d all;
    double area = 0, volumes = 0;
    for (const auto& triangle : triangles) {
      const auto at = [&](std::size_t k) {
        return poses.position(p, static_cast<std::size_t>(triangle[k]));
      };
      const Vector3d a = at(0), b = at(1), c = at(2);
      Eigen::AlignedBox3d box(a);
      box.extend(b).extend(c);
      all.extend(box);
      area += (b - a).cross(c - a).norm() / 2;
      volumes += box.volume();
    }
    least = std::max({least, std::sqrt(area / kMostSquares),
                      std::cbrt(std::max(all.volume() / kMostBlocks, volumes / kMostScanned)) /
                          DistanceGrid::kBlock});
  }
  return least;
}

}  // namespace weft

#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "core/contact/pose_grid.h"
#include "core/model/scene.h"

namespace weft {

// A body between two of its grids, which lie around its middle.
struct PosedBody {
  std::shared_ptr<const PoseGrid> from, to;
  double share = 0;                     // of the way from one to the other
  double step = 0;                      // of it in the step
  Vector3d offset = Vector3d::Zero();   // of the middle, m
  Vector3d carried = Vector3d::Zero();  // its displacement in the step, m
  double moved = 0;                     // how far the surface moves in the step, at most, m
};

// The bodies of a scene that move through poses. Between poses that are far from each other lie
// more, so that no place goes farther than a cell from one grid to the next. Grids are made when
// time comes to them, and only the last ones are kept: what they say follows from the scene alone.
class MovingBodies {
 public:
  MovingBodies() = default;
  explicit MovingBodies(std::span<const Collider> colliders);

  // Where they are at the end of a step from `time` - dt to `time`, s. colliders: the same, however
  // they are led.
  void place(std::span<const Collider> colliders, double time, double dt);
  // Of a collider as it was placed; nullptr: it is none of these, or stands in its first pose.
  const PosedBody* of(std::size_t collider) const;
  // Grids are made again when they are needed.
  void release_memory();

 private:
  // A grid lies at the share part / parts of the way from a pose to the next.
  using At = std::pair<std::size_t, int>;  // pose and part
  struct Moving {
    std::shared_ptr<const Poses> poses;
    SharedBody body;
    PosedBody placed;
    bool is_posed = false;
    std::map<At, std::shared_ptr<const PoseGrid>> grids;
  };
  // From one time of its poses to another, s, which may lie before it.
  static void place(Moving& moving, double begin, double end);
  static std::shared_ptr<const PoseGrid> grid(Moving& moving, At at);

  std::map<std::size_t, Moving> bodies_;  // by collider
};

// How many grids are made while it moves through all of its poses.
std::int64_t count_grids(const Poses& poses, double cell);

// The cell below which grids of a pose take too much memory or time, m.
double least_pose_cell(const Poses& poses, const std::vector<std::array<int, 3>>& triangles);

}  // namespace weft

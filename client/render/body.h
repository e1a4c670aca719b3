#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <variant>
#include <vector>

#include "client/recording/points.h"
#include "weft/v1/scene.pb.h"

namespace weft::client {

// Colliders as they stand at one time, m.
struct Ball {
  Eigen::Vector3d centre;
  double radius;
};
struct Capsule {
  Eigen::Vector3d start, end;
  double radius;
};
struct Cuboid {
  Eigen::Vector3d centre, half_size;
  Eigen::Quaterniond rotation;
};
struct HalfSpace {
  Eigen::Vector3d point, normal;  // a unit vector, out of it
};
struct Solid {
  Points corners;  // where the body starts, m
  std::vector<std::array<float, 3>> normals;
  std::vector<std::uint32_t> triangles;
  Eigen::Vector3d offset;  // from there
};
using Body = std::variant<Ball, Capsule, Cuboid, HalfSpace, Solid>;

// The scene's colliders, moved along their paths; of triangles those whose mesh it holds.
// pose_times_s: FrameStats.pose_times_s.
std::vector<Body> bodies_at(const v1::Scene& scene, double time_s,
                            const std::vector<double>& pose_times_s = {});

// A way to the surface of a body, out of it or on to it.
struct Way {
  double distance;            // m, negative inside
  Eigen::Vector3d direction;  // outwards; at the surface its normal
};
// The nearest; but less deep in a box than `rounding`, in a direction that turns evenly around its
// edges. Of triangles it is not looked for: infinitely far.
Way way_out(const Body& body, const Eigen::Vector3d& place, double rounding = 0);

// Balls that reach as far as the body does in every direction; of a half space none.
std::vector<Ball> hull_of(const Body& body);

}  // namespace weft::client

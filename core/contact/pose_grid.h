#pragma once

#include <array>
#include <vector>

#include "core/model/body.h"

namespace weft {

// Distances from a body in one pose, and how its surface goes on from there.
struct PoseGrid {
  DistanceGrid distances;
  // Along each axis, at each of the values: how far the nearest place of the surface goes, m; 0
  // farther away than the distances' reach.
  std::array<std::vector<float>, 3> ways;
};

// Made while a simulation runs: exact as far as `reach` (m) from the surface, inside as deep;
// deeper, values only lead out. ways: of the vertices, m.
PoseGrid make_pose_grid(const BodyMesh& mesh, const std::vector<Vector3d>& ways, double cell,
                        double reach);

}  // namespace weft

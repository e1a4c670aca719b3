#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/model/mesh.h"

namespace weft {

using Eigen::Vector2d;

// The flat shape of a sheet of triangles: u along the warp, v along the weft. Corners of one
// particle may differ, where a seam is closed. Triangles run counter-clockwise in (u, v).
struct RestShape {
  int particles = 0;
  std::vector<std::array<int, 3>> triangles;     // particles of each
  std::vector<std::array<Vector2d, 3>> corners;  // (u, v) of each, m
};

// Rest area of a triangle, m^2.
double area(const std::array<Vector2d, 3>& corners);

// Rest area that belongs to each particle, a third of every triangle around it, m^2.
VectorXd areas(const RestShape& shape);

// Each once, the smaller index first, in ascending order.
std::vector<Connection> edges(const RestShape& shape);

// Of each particle, whether it lies on an edge of one triangle alone.
std::vector<bool> border(const RestShape& shape);

}  // namespace weft

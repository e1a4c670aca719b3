#pragma once

#include <string>

#include "core/triangles/rest_shape.h"

namespace weft::testing {

// How a rectangle is cut into triangles.
enum class Cut { kRight, kAlternating, kEquilateral, kIrregular };

// A square of that width, m; of kEquilateral as near to it as rows fit.
RestShape square(Cut cut, double width, double spacing);

// A square of so many points along each side, scattered and joined as Delaunay does: of any
// valence.
RestShape scattered(int columns, double spacing);

// From particles' (u, v), one each.
RestShape rest_shape(const std::vector<Vector2d>& points,
                     const std::vector<std::array<int, 3>>& triangles);

// (u, v) of each particle, by its first corner.
std::vector<Vector2d> points_of(const RestShape& shape);

// A mesh with that flat shape, corners of one particle alike, lying flat; its warp along u.
TriangleMesh triangle_mesh(const RestShape& shape);

}  // namespace weft::testing

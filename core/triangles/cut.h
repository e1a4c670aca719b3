#pragma once

#include <array>
#include <vector>

#include "core/triangles/rest_shape.h"

namespace weft {

// How a piece is cut into triangles.
enum class Cut {
  kRight,        // squares with all diagonals alike
  kAlternating,  // squares with diagonals that take turns
  kEquilateral,  // edges along v, none along u: it folds about v
  kIrregular  // a grid whose points are moved by up to 0.3 of its spacing, along the border alone
};

// A rectangle along u and v, of whole triangles whose edges are `spacing` long, or so; a corner
// lies at the origin. m
RestShape cut_rectangle(Cut cut, double length, double width, double spacing);

// Between columns of particles of a rectangle, spacings.
double column_step(Cut cut);

// A disc about the origin, whose border is a polygon of edges that long.
RestShape cut_disc(Cut cut, double radius, double spacing);

// From particles' (u, v), one each.
RestShape rest_shape(const std::vector<Vector2d>& points,
                     const std::vector<std::array<int, 3>>& triangles);

// (u, v) of each particle, by its first corner.
std::vector<Vector2d> points_of(const RestShape& shape);

// A mesh with that flat shape, corners of one particle alike; it lies flat with its warp, u, along
// x and v along z.
TriangleMesh triangle_mesh(const RestShape& shape);

}  // namespace weft

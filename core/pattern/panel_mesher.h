#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "core/model/shape.h"

namespace weft {

// Triangles that fill a border, anticlockwise.
struct PanelMesh {
  std::vector<Vector2d> points;  // the border's first, m
  std::vector<std::array<int, 3>> triangles;
};

// Fills a border with triangles whose edges are about `edge` long, m: equilateral ones inside, with
// an edge along the grain (rad, from the v axis, anticlockwise), and what fits along the border,
// whose points stay as they are. Mirrored borders have mirrored triangles, up to rounding; so has a
// symmetric border, about its axis u = constant, where that passes two of its points.
// Precondition: the border runs anticlockwise and find_crossing() finds none.
PanelMesh mesh_panel(const std::vector<Vector2d>& border, double grain, double edge);

// Two lines of a closed border, by their first points, that meet elsewhere than neighbours do.
std::optional<std::pair<int, int>> find_crossing(const std::vector<Vector2d>& border);

double area_within(const std::vector<Vector2d>& border);  // m^2, below 0 where it runs clockwise

double least_height(const std::array<Vector2d, 3>& triangle);  // m

}  // namespace weft

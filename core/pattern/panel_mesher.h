#pragma once

#include <array>
#include <vector>

#include "core/pattern/panel_lines.h"

namespace weft {

// Triangles that fill a border, anticlockwise.
struct PanelMesh {
  std::vector<Vector2d> points;  // the border's, those inside on creases, and others, m
  std::vector<std::array<int, 3>> triangles;
};

// Fills a border with triangles whose edges are about `edge` long, m: equilateral ones inside, with
// an edge along the grain (rad, from the v axis, anticlockwise), and what fits along the border and
// creases, whose points stay as they are, and whose lines are edges. Mirrored panels have mirrored
// triangles, up to rounding; so has a symmetric panel, about its axis u = constant, where that
// passes two points of the border, and no crease between its points.
// Precondition: the border runs anticlockwise, find_crossing() finds none, nor find_tight() with
// kCreaseRoom.
PanelMesh mesh_panel(const PanelLines& lines, double grain, double edge);

double least_height(const std::array<Vector2d, 3>& triangle);  // m

}  // namespace weft

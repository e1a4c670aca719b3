#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/pattern/borders.h"

namespace weft {

// A place on an outline.
struct OutlinePlace {
  int edge = 0;
  double share = 0;  // of the edge's length
};

// Where an outline is nearest to a point, if it comes nearer than that, m.
std::optional<OutlinePlace> nearest_place(const std::vector<Curve>& outline, const Vector2d& point,
                                          double reach);

// Points along a line, about `edge` apart, m, with its ends, its corners, and where it meets the
// line u = axis; lesser turns are rounded off.
std::vector<Vector2d> follow(const std::vector<Vector2d>& line, double edge,
                             std::optional<double> axis);

// What keeps a panel from being creased as it wants: the first of its lines that leaves it, meets
// another, or leaves no room for triangles. panel: its path.
std::vector<Problem> crease_problems(const PatternPanel& panel, const Border& border, double edge,
                                     const std::string& path);

}  // namespace weft

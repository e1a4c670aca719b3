#pragma once

#include "client/imports/imported_mesh.h"

namespace weft::client {

// A border of triangles: edges that one of them has, as a closed loop.
struct Border {
  std::string name;            // top, bottom, left or right where it lies there as a whole, else ""
  std::vector<int> particles;  // in order, each once
  double length = 0;           // m
  Vector3d centre = Vector3d::Zero();
};

// Particles and length of the edges of borders that look to one side.
struct BorderSide {
  std::vector<int> particles;  // ascending
  double length = 0;           // m
};

// Where top and right are: x to the right and y up, as seen from the front, or of a mesh that lies
// level, -z up, as seen from above.
struct View {
  Vector3d right = Vector3d::UnitX(), up = Vector3d::UnitY();
};
View view_of(const std::vector<Vector3d>& positions);

// The longest first.
std::vector<Border> find_borders(const std::vector<Vector3d>& positions, const Triangles& triangles,
                                 const View& view);

inline constexpr std::array kBorderSides = {"top", "bottom", "left", "right"};

// What border:NAME is: the loop of that number, from 1; all loops of that name; or where there is
// none, the edges that look to that side, up, down, to the left or right. Empty: none.
BorderSide border_called(const std::vector<Vector3d>& positions, const Triangles& triangles,
                         const View& view, const std::string& name);

}  // namespace weft::client

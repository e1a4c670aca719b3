#pragma once

#include "client/imports/imported_mesh.h"

namespace weft::client {

// Corners of a polygon that a file may have.
inline constexpr std::size_t kMostCorners = 256;

// Cuts a polygon into triangles of its corners' numbers, as it lies in its mean plane: one of four
// corners along its shorter diagonal, others ear by ear, so that hollows stay hollow.
Triangles cut_polygon(const std::vector<Vector3d>& corners);

}  // namespace weft::client

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "client/recording/points.h"
#include "weft/v1/frame.pb.h"

namespace weft::client {

// The corners of a cell.
using Quad = std::array<std::int32_t, 4>;

// The cells of a sheet, row by row, seen from above a flat sheet anticlockwise.
std::vector<Quad> quads_of(const v1::SheetLayout& sheet);

// Two triangles of each cell, as indices of their corners.
std::vector<std::uint32_t> triangles_of(const std::vector<v1::SheetLayout>& sheets);

// Unit vectors, the mean of the triangles around a particle by their area.
std::vector<std::array<float, 3>> normals_of(const Points& points,
                                             const std::vector<std::uint32_t>& triangles);

}  // namespace weft::client

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "weft/v1/frame.pb.h"

// What a stream's header says of a sheet's particles. Who reads, exports or draws frames asks here,
// not for the sheet's shape.
namespace weft::client {

// Precondition of all others: the layout is sound.
bool is_sound(const v1::SheetLayout& sheet);

std::size_t particle_count(const v1::SheetLayout& sheet);

// "31 x 31 particles"
std::string shape_text(const v1::SheetLayout& sheet);

// The corners of a cell.
using Quad = std::array<std::int32_t, 4>;

// The cells of a sheet, row by row, seen from above a flat sheet anticlockwise.
std::vector<Quad> quads_of(const v1::SheetLayout& sheet);

// Two triangles of each cell, as indices of their corners.
std::vector<std::uint32_t> triangles_of(const std::vector<v1::SheetLayout>& sheets);

// Where a particle lies, counted from the sheet's first.
struct GridPlace {
  int row = 0;
  int column = 0;
};
GridPlace place_in(const v1::SheetLayout& sheet, int particle);

}  // namespace weft::client

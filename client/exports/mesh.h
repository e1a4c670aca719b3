#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "weft/v1/frame.pb.h"

namespace weft::client {

// The corners of a cell.
using Quad = std::array<std::int32_t, 4>;

// The cells of a sheet, row by row, seen from above a flat sheet anticlockwise.
std::vector<Quad> quads_of(const v1::SheetLayout& sheet);

}  // namespace weft::client

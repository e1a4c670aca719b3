#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "client/recording/points.h"
#include "client/sheet_layout.h"

namespace weft::client {

// Unit vectors, the mean of the triangles around a particle by their area.
std::vector<std::array<float, 3>> normals_of(const Points& points,
                                             const std::vector<std::uint32_t>& triangles);

}  // namespace weft::client

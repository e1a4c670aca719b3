#pragma once

#include <vector>

#include "core/model/scene.h"

namespace weft {

// Strains of all triangles of sheets, in the order of triangles_of(): planes of l / L - 1 along the
// warp, the same along the weft, and the sine of the angle that both are sheared by. positions:
// (3 x particles) planes x, y, z, m, the sheets one after the other.
std::vector<double> strains_of(const std::vector<double>& positions,
                               const std::vector<SheetShape>& sheets);

}  // namespace weft

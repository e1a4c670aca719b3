#pragma once

#include <vector>

#include "core/model/scene.h"

namespace weft {

// Unit normals of sheets at their particles. positions: (3 x particles) planes x, y, z, m, the
// sheets one after the other; so is what is returned, without unit. Along the cross product of the
// line between the neighbours in the row, from the first column to the last, with that between
// those in the column; of triangles the sum of those around a particle. Both weigh triangles by
// area; 0 where there is none.
std::vector<double> normals_of(const std::vector<double>& positions,
                               const std::vector<SheetShape>& sheets);

}  // namespace weft

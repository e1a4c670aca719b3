#pragma once

#include "core/motion/tethers.h"
#include "core/triangles/rest_shape.h"

namespace weft {

// Finds the nearest particle of each attachment along the cloth, and how far that is over the flat
// shape: exact where triangles are acute and the way is straight, else longer.
void measure_tethers(const RestShape& shape, Tethers& tethers);

}  // namespace weft

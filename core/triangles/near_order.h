#pragma once

#include <vector>

namespace weft {

// Particles in an order that keeps neighbours near, in blocks and patches of TriangleLaw.
std::vector<int> near_order(const std::vector<std::vector<int>>& neighbours);

}  // namespace weft

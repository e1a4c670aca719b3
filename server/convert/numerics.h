#pragma once

#include <string>

namespace weft {

// Frames of servers with equal ids are equal to the bit.
std::string numerics_id();

}  // namespace weft

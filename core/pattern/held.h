#pragma once

#include <vector>

#include "core/pattern/garment.h"

namespace weft {

// What carries a garment until it hangs by itself: particles of edges that are labelled "waist", or
// "waist-" and something. Without such, of the highest border where hardly any cloth lies higher:
// what has shoulders hangs from them. Ascending.
std::vector<int> held_particles(const Pattern& pattern, const Garment& garment);

}  // namespace weft

#pragma once

#include <vector>

#include "core/pattern/garment.h"

namespace weft {

// What carries a garment until it hangs by itself: none where much cloth lies above the lowest
// point of the highest border, or another border reaches as high as the middle of it, as an armhole
// does: what has shoulders hangs from them. Else particles of edges that are labelled "waist", or
// "waist-" and something; without such, of that border. Ascending.
std::vector<int> held_particles(const Pattern& pattern, const Garment& garment);

}  // namespace weft

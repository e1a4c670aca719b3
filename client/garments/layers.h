#pragma once

#include <string>

#include "weft/v1/garment.pb.h"
#include "weft/v1/scene.pb.h"

namespace weft::client {

// What is worn at the end of the recording in a file: its sheets, which start there, its bodies and
// holds. Throws Problem where there is none, or a body moves.
v1::Scene worn_at_end(const std::string& path);

// Moves panels away from the body, each along its outside, until what is worn is behind them.
// m, the farthest.
double place_over(v1::Pattern& pattern, const v1::Scene& worn);

// Puts a garment on over what is worn: sheets of that come first, its bodies wear both. A sheet
// whose name is taken gets another.
void wear_over(v1::Scene& garment, v1::Scene worn);

}  // namespace weft::client

#pragma once

#include <array>
#include <string>
#include <vector>

#include "client/recording/points.h"
#include "weft/v1/garment.pb.h"
#include "weft/v1/scene.pb.h"

namespace weft::client {

// What somebody wears.
struct Worn {
  v1::Scene scene;  // its sheets start as they are worn; its bodies and holds
  Points points;    // of all particles, m
  std::vector<std::array<float, 3>> normals;  // of these, out of the body
};

// At the end of the recording in a file. Throws Problem where there is none, or a body moves.
Worn worn_at_end(const std::string& path);

// Moves panels away from the body, each along its outside, until what is worn is behind them.
// m, the farthest.
double place_over(v1::Pattern& pattern, const Worn& worn);

// Puts a garment on over what is worn: sheets of that come first, its bodies wear both. A sheet
// whose name is taken gets another.
void wear_over(v1::Scene& garment, Worn worn);

}  // namespace weft::client

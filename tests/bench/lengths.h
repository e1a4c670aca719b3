#pragma once

#include <vector>

namespace weft::bench {

// Lengths of bend connections as shares of their rest lengths, in [0, 1): what the bending
// functions are timed on.

// 4096 of them, spread evenly, in no order.
const std::vector<double>& even_lengths();

// Those of a sheet of 31 x 31 particles hung by two corners, over 64 frames of 0.1 s from the start
// (the paper's experiment 1), step after step; 1 where a connection is not shortened.
const std::vector<double>& hung_lengths();
inline constexpr int kHungSteps = 64;

}  // namespace weft::bench

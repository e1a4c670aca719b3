#pragma once

#include <cstdint>
#include <optional>

#include "weft/v1/frame.pb.h"

namespace weft::client {

// What a run of frames amounts to.
struct Tally {
  std::int64_t frames = 0;
  std::int64_t first_frame = 0;
  std::int64_t last_frame = 0;
  double first_time_s = 0;
  double last_time_s = 0;
  std::int64_t substeps = 0;
  double largest_strain = 0;
  std::int64_t repairs = 0;
  std::optional<std::int64_t> most_cuts;  // of a frame; where they are counted
  std::int64_t bytes = 0;                 // of the arrays
  v1::FrameStats last_stats;

  void add(const v1::Frame& frame);
};

}  // namespace weft::client

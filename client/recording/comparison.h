#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "client/recording/frame_range.h"
#include "client/recording/reader.h"
#include "client/sheet_layout.h"

namespace weft::client {

// How far two recordings of equal sheets and frame step lie apart, in the frames that both hold.
struct Comparison {
  std::int64_t first_frame = 0;
  std::int64_t last_frame = 0;
  bool same_frames = true;  // neither holds a frame that the other lacks

  // Distance between the two places of a particle, m.
  double rms_m = 0;      // over all particles and frames
  double largest_m = 0;  // infinite where one place is not finite
  std::int64_t frame = 0;
  double time_s = 0;
  std::string sheet;               // the sheet and particle of the largest
  int particle = 0;                // counted from the sheet's first
  std::optional<GridPlace> place;  // of a grid

  // First frame that is not the same to the bit: time, arrays and facts.
  std::optional<std::int64_t> first_unequal;
  bool bit_equal() const { return same_frames && !first_unequal; }
};

// A frame at a time, so memory does not grow with the recordings. Throws where they cannot be
// compared.
Comparison compare(RecordingReader& a, RecordingReader& b, const FrameRange& range,
                   const std::function<void(std::int64_t frame)>& progress);

}  // namespace weft::client

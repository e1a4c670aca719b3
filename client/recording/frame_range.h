#pragma once

#include <cstdint>
#include <limits>

namespace weft::client {

// Frames by number, both ends included; by default all.
struct FrameRange {
  std::int64_t first = 0;
  std::int64_t last = std::numeric_limits<std::int64_t>::max();
};

}  // namespace weft::client

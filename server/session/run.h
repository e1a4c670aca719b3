#pragma once

#include <cstdint>
#include <optional>

#include "server/session/scheduler.h"

namespace weft {

// A run: how fast it goes, and how far.
struct ActiveRun {
  std::optional<double> time_scale;  // simulated s per s; absent: as fast as possible
  std::optional<std::int64_t> until_frame;
  bool until_rest = false;
  Clock::time_point start_time;  // of the pace, when the frame was start_frame
  std::int64_t start_frame = 0;

  // The pace begins anew: time lost is not made up for in a rush.
  void restart(Clock::time_point now, std::int64_t frame) {
    start_time = now;
    start_frame = frame;
  }

  bool reached(std::int64_t frame, bool at_rest) const {
    return (until_frame && frame >= *until_frame) || (until_rest && at_rest);
  }

  // When a frame is to be there. frame_step: s.
  Clock::time_point due(std::int64_t frame, double frame_step) const {
    if (!time_scale) return Clock::time_point::min();
    const std::chrono::duration<double> since_start(static_cast<double>(frame - start_frame) *
                                                    frame_step / *time_scale);
    return start_time + std::chrono::duration_cast<Clock::duration>(since_start);
  }
};

}  // namespace weft

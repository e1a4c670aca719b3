#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace weft {

// How many durations fell between bounds that double. Thread-safe.
class DurationHistogram {
 public:
  static constexpr std::size_t kBuckets = 20;
  // Upper bound of a bucket, s: 64 us, 128 us ... The last one has none.
  static constexpr double bound(std::size_t bucket) {
    return 64e-6 * static_cast<double>(1u << bucket);
  }

  void add(std::chrono::duration<double> duration);
  std::int64_t count(std::size_t bucket) const { return counts_[bucket]; }
  double sum() const { return static_cast<double>(nanoseconds_) * 1e-9; }  // s

 private:
  std::array<std::atomic<std::int64_t>, kBuckets> counts_{};
  std::atomic<std::int64_t> nanoseconds_ = 0;
};

// What a server has done since it began.
struct Stats {
  using Count = std::atomic<std::int64_t>;

  const std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
  Count frames = 0;           // with those of sleeping sessions
  Count sleeping_frames = 0;  // that repeat, without a substep
  Count substeps = 0;
  Count particle_substeps = 0;
  Count repairs = 0;
  Count failures = 0;
  Count taken_over = 0;          // sessions, from the store or another server
  Count given_away = 0;          // sessions, to the store or another server
  DurationHistogram frame_time;  // to compute a frame
  DurationHistogram lateness;    // of frames of paced sessions, against their time

  Count streams = 0;  // open now
  Count frames_sent = 0;
  Count bytes_sent = 0;    // of frame messages
  Count slow_readers = 0;  // streams that ended because their frame was no longer kept

  Count assets = 0;       // kept, as far as was seen last
  Count asset_bytes = 0;  // of them, those still to come included
  Count asset_bytes_received = 0;
  Count asset_bytes_sent = 0;
};

}  // namespace weft

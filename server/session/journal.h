#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/session/log.h"
#include "server/session/scheduler.h"

namespace weft {

// How far ahead of the newest frame the publish limit is put: so far that it is written about once
// in `interval`. Not thread-safe.
class PublishAhead {
 public:
  // frame_step: s.
  PublishAhead(std::chrono::duration<double> interval, double frame_step)
      : interval_(interval), frame_step_(frame_step) {}

  // For a run at that pace; frames. At a pace, those of the time for two of its writes, and no more
  // where it catches up, for a restart computes all of them.
  std::int64_t frames(std::optional<double> time_scale) const {
    if (!time_scale) return ahead_;
    const double frames = 2 * interval_.count() * *time_scale / frame_step_;
    return std::clamp(static_cast<std::int64_t>(std::min(frames, 1.0 * kMost)), kLeast, kMost);
  }
  std::int64_t frames() const { return ahead_; }

  // The frames have nearly reached the limit.
  void note_used_up(Clock::time_point now) {
    if (now - told_ < interval_) ahead_ = std::min(2 * ahead_, kMost);
    if (now - told_ > 4 * interval_) ahead_ = std::max(ahead_ / 2, kLeast);
    told_ = now;
  }

 private:
  static constexpr std::int64_t kLeast = 8, kMost = 16'384;
  const std::chrono::duration<double> interval_;
  const double frame_step_;
  std::int64_t ahead_ = 16;
  Clock::time_point told_;
};

// What is written of a session, or is being written. Not thread-safe.
struct Journal {
  Journal(std::chrono::duration<double> interval, double frame_step)
      : ahead(interval, frame_step) {}

  // Whether an entry, or a snapshot on demand, is under way; the session waits for it.
  bool waits() const { return then_ != nullptr; }
  bool idle() const { return !waits() && !limit_under_way; }

  // A write has begun, after which `then` is to be called with its outcome: an error, or nothing.
  void begin(std::function<void(const std::string& error)> then) {
    then_ = std::move(then);
    written_.reset();
  }
  void end(const std::string& error) { written_ = error; }
  // What is to be called with what, where the write is over.
  std::optional<std::pair<std::function<void(const std::string&)>, std::string>> take() {
    if (!then_ || !written_) return std::nullopt;
    return std::pair{std::exchange(then_, nullptr), *std::exchange(written_, std::nullopt)};
  }

  PublishLimit limit;  // as it was written last
  bool limit_under_way = false;
  PublishAhead ahead;
  std::vector<NamedSnapshot> named;  // in order of frame

 private:
  std::function<void(const std::string& error)> then_;
  std::optional<std::string> written_;
};

}  // namespace weft

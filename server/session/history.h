#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>

#include "server/session/frame.h"

namespace weft {

// The newest frames of a session: consecutive, bounded by bytes, at least two once there are two.
// Not thread-safe.
class History {
 public:
  explicit History(std::size_t max_bytes);
  ~History();
  History(const History&) = delete;
  History& operator=(const History&) = delete;

  // Drops all frames; the next one is this.
  void begin(std::shared_ptr<const Frame> frame);

  // Adds the next frame and drops the oldest ones that no longer fit, but none from `keep_from` on.
  void push(std::shared_ptr<const Frame> frame, std::int64_t keep_from);

  // Whether one more frame would drop the oldest.
  bool full() const;

  // The frame of that number, or nullptr.
  std::shared_ptr<const Frame> find(std::int64_t number) const;

  // Precondition: not empty.
  std::int64_t oldest() const { return frames_.front()->number; }
  const std::shared_ptr<const Frame>& latest() const { return frames_.back(); }

 private:
  std::size_t bytes() const { return frame_bytes_ + *encoding_bytes_; }
  void drop_oldest();

  std::size_t max_bytes_;
  std::size_t frame_bytes_ = 0;
  ByteMeter encoding_bytes_ = std::make_shared<std::atomic<std::size_t>>(0);
  std::deque<std::shared_ptr<const Frame>> frames_;
};

}  // namespace weft

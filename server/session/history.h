#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>

#include "server/session/frame.h"
#include "server/session/history_budget.h"

namespace weft {

// The newest frames of a session: consecutive, as many as its share of a budget holds with their
// encodings, at least two once there are two. Not thread-safe.
class History {
 public:
  explicit History(std::shared_ptr<HistoryBudget> budget);
  ~History();
  History(const History&) = delete;
  History& operator=(const History&) = delete;

  // Whether somebody reads it; nobody at first.
  void set_read(bool read);

  // Drops all frames; the next one is this.
  void begin(std::shared_ptr<const Frame> frame);

  // Adds the next frame and drops the oldest ones that no longer fit, but none from `keep_from` on.
  void push(std::shared_ptr<const Frame> frame, std::int64_t keep_from);
  // Drops the oldest ones that no longer fit, for others have come.
  void trim(std::int64_t keep_from);

  // Whether one more frame would drop the oldest.
  bool full() const;

  // The frame of that number, or nullptr.
  std::shared_ptr<const Frame> find(std::int64_t number) const;

  // Precondition: not empty.
  std::int64_t oldest() const { return frames_.front()->number; }
  const std::shared_ptr<const Frame>& latest() const { return frames_.back(); }

 private:
  void drop_oldest();

  const std::shared_ptr<HistoryBudget> budget_;
  bool read_ = false;
  const std::shared_ptr<ByteMeter> bytes_;  // of frames and encodings
  std::deque<std::shared_ptr<const Frame>> frames_;
};

}  // namespace weft

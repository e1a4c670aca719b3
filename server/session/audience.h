#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "server/session/history.h"
#include "server/session/log.h"
#include "server/session/scheduler.h"
#include "server/session/subscription.h"

namespace weft {

// A session's frames that are kept, and who reads them: how far they are, whether one holds the
// session back, and which may come back after a restart. Not thread-safe.
class Audience {
 public:
  using Time = Clock::time_point;

  // return_time: readers that are cut off come back within it, and find every frame again.
  Audience(std::shared_ptr<HistoryBudget> budget, std::chrono::duration<double> return_time)
      : history_(std::move(budget)), return_time_(return_time) {}

  // The first frame, or one to go on from; what was kept before it is dropped.
  void begin(std::shared_ptr<const Frame> frame) { history_.begin(std::move(frame)); }
  // The next one.
  void push(std::shared_ptr<const Frame> frame, Time now);
  // Drops frames that no longer fit.
  void trim(Time now);
  const std::shared_ptr<const Frame>& newest() const { return history_.latest(); }
  std::int64_t latest() const { return newest()->number; }
  std::int64_t oldest() const { return history_.oldest(); }

  void add(FrameReader& reader, Time now);
  void remove(const FrameReader& reader) { std::erase(readers_, &reader); }
  bool has_any() const { return !readers_.empty(); }
  bool wants_stats() const {
    return std::ranges::any_of(readers_, [](const FrameReader* each) { return each->wants_stats; });
  }
  // Readers that want every frame.
  int recorders() const;
  // Whom to tell of a new frame.
  std::vector<std::shared_ptr<FrameSink>> sinks() const;

  // What a reader finds where it is; it is one further then.
  struct Found {
    std::shared_ptr<const Frame> frame;
    std::int64_t skipped = 0;  // frames left out before it
    bool expired = false;      // its frame is not kept any more
  };
  Found take_next(FrameReader& reader);

  // Readers that an earlier process had may come back until then.
  void expect_back(const PublishLimit& left, Time until);
  // Until when the next frame waits for holders that may come back.
  std::optional<Time> holds_until(Time now);
  // Whether the next frame has to wait for a reader. One that is here gets half of the history for
  // frames to come: the other half is what was sent to it and may not have come.
  bool must_hold(Time now);

  // What the log is to know: frames up to this one may be published, and readers need these.
  PublishLimit limit_at(std::int64_t frame, Time now);
  // Whether the log knows of all readers that frames are held for.
  bool knows_holders(const PublishLimit& limit, Time now) { return holders(now) <= limit.holders; }
  // Whether it knows of readers as they are now.
  bool knows_readers(const PublishLimit& limit, Time now) const;

 private:
  // Readers of an earlier process that held it back, and may come back.
  struct AbsentHolders {
    int count = 0;
    std::int64_t held_from = 0;
    Time until;
  };
  // How far all of them were at a time.
  struct ReadMark {
    Time time;
    std::int64_t next;  // the first frame that one had not taken
  };

  void forget_absent(Time now);
  int holders(Time now);
  int readers(Time now) const;
  bool has_readers(Time now) const;
  std::int64_t first_held(Time now);
  std::int64_t first_wanted_by(SlowReader policy) const;
  std::int64_t wanted_from(Time now);

  History history_;
  const std::chrono::duration<double> return_time_;
  std::vector<FrameReader*> readers_;
  std::optional<AbsentHolders> absent_holders_;
  int absent_readers_ = 0;        // that have not come back
  std::int64_t absent_from_ = 0;  // the first frame that they want
  Time absent_until_;
  std::deque<ReadMark> read_marks_;  // within the return time, the newest and farthest last
};

}  // namespace weft

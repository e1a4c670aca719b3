#include <algorithm>
#include <limits>
#include <variant>

#include "server/session/session.h"

namespace weft {

// Has the log say in advance how far frames are published, so that none is ever changed.
void Session::write_reach() {
  Reach reach;
  {
    std::lock_guard lock(mutex_);
    if (writing_.reach || writing_.then || closed_ || restoring_) return;
    const std::int64_t ahead = run_ ? ahead_of(run_->time_scale) : ahead_;
    const std::int64_t wanted = std::min(latest() + ahead / 2, goal());
    const bool suffices = !active() || (reach_.frame >= wanted && reach_suffices());
    if (suffices && has_readers() == reach_.history_from.has_value() && readers() == reach_.readers)
      return;
    const auto now = Clock::now();
    if (!suffices) {
      if (now - reach_time_ < reach_interval_) ahead_ = std::min(2 * ahead_, kMostAhead);
      if (now - reach_time_ > 4 * reach_interval_) ahead_ = std::max(ahead_ / 2, kLeastAhead);
      reach_time_ = now;
    }
    reach = reach_to(std::min(latest() + ahead, goal()));
    writing_.reach = true;
  }
  log_->write(std::nullopt, reach, [self = shared_from_this(), reach](const std::string&) {
    {
      std::lock_guard lock(self->mutex_);
      self->reach_ = reach;  // even where it could not be written: the session goes on
      self->writing_.reach = false;
    }
    self->wake();
  });
}

Reach Session::reach_to(std::int64_t frame) {
  Reach reach{frame, holders()};
  if (has_readers()) reach.history_from = wanted_from();
  reach.readers = readers();
  return reach;
}

// The first frame that subscribers may want again if they are cut off, as far as it is kept. What
// was sent to them may never have come, so it is not enough that they have taken it: what they
// had is noted for as long as they may take to come back.
std::int64_t Session::wanted_from() {
  constexpr int kNotes = 60;
  const auto now = Clock::now();
  std::int64_t next =
      std::min(first_wanted_by(SlowReader::kDisconnect), first_wanted_by(SlowReader::kHoldSession));
  if (recorders() > 0 && (taken_.empty() || now - taken_.back().time >= return_time_ / kNotes))
    taken_.push_back({now, next});
  while (taken_.size() > 1 && now - taken_[1].time >= return_time_) taken_.pop_front();
  for (const Taken& taken : taken_) next = std::min(next, taken.next);
  return std::clamp(next, history_.oldest(), latest());
}

// Subscribers that want every frame.
int Session::recorders() const {
  return static_cast<int>(
      std::count_if(subscriptions_.begin(), subscriptions_.end(),
                    [](const auto* each) { return each->policy_ != SlowReader::kSkip; }));
}

// Whether there are such, or some that may come back.
bool Session::has_readers() const {
  return recorders() > 0 || past_holders_ || Clock::now() < readers_until_;
}

int Session::readers() const {
  return recorders() + (Clock::now() < readers_until_ ? past_readers_ : 0);
}

// How far frames may be published once the event is in the log.
std::int64_t Session::reach_after(const Event& event) const {
  if (const auto* steps = std::get_if<StepsBegun>(&event)) {
    return latest() + std::min(steps->frames, ahead_);
  }
  if (const auto* run = std::get_if<RunBegun>(&event)) {
    const std::int64_t ahead = latest() + ahead_of(run->time_scale);
    return run->until_frame ? std::min(ahead, std::max(*run->until_frame, goal())) : ahead;
  }
  const bool goes_on = std::holds_alternative<TextileSet>(event) ||
                               std::holds_alternative<Acted>(event) ||
                               std::holds_alternative<SnapshotKept>(event)
                           ? active()
                           : std::holds_alternative<StepsEnded>(event) && run_.has_value();
  return goes_on ? std::max(latest(), reach_.frame) : latest();
}

// Frames that the reach is put ahead: at a pace, those of the time for two of its writes, and no
// more where it catches up, for a restart computes all of them.
std::int64_t Session::ahead_of(std::optional<double> time_scale) const {
  if (!time_scale) return ahead_;
  const double frames = 2 * reach_interval_.count() * *time_scale / scene_.solver.frame_step;
  return std::clamp(static_cast<std::int64_t>(std::min(frames, 1.0 * kMostAhead)), kLeastAhead,
                    kMostAhead);
}

// Whether the log knows of all subscribers that frames are held for.
bool Session::reach_suffices() { return holders() <= reach_.holders; }

// Subscribers with HOLD_SESSION, and those that may come back.
int Session::holders() {
  forget_past_holders();
  const auto here =
      std::count_if(subscriptions_.begin(), subscriptions_.end(),
                    [](const auto* each) { return each->policy_ == SlowReader::kHoldSession; });
  return static_cast<int>(here) + (past_holders_ ? past_holders_->count : 0);
}

void Session::forget_past_holders() {
  if (past_holders_ && past_holders_->until <= Clock::now()) past_holders_.reset();
}

// First frame that one of them still needs.
std::int64_t Session::first_held_frame() {
  forget_past_holders();
  const auto first = first_wanted_by(SlowReader::kHoldSession);
  return past_holders_ ? std::min(first, past_holders_->held_from) : first;
}

// Whether the next frame has to wait for a subscriber. One that is here gets half of the history
// for frames to come: the other half is what was sent to it and may not have come.
bool Session::must_hold() {
  if (!history_.full()) return false;
  const auto oldest = history_.oldest();
  forget_past_holders();
  return (past_holders_ && past_holders_->held_from <= oldest) ||
         first_wanted_by(SlowReader::kHoldSession) <= (oldest + latest()) / 2;
}

// Next frame of the slowest with that policy; the largest number where there is none.
std::int64_t Session::first_wanted_by(SlowReader policy) const {
  auto first = std::numeric_limits<std::int64_t>::max();
  for (const Subscription* subscription : subscriptions_)
    if (subscription->policy_ == policy) first = std::min(first, subscription->next_);
  return first;
}

}  // namespace weft

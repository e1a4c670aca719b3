#include "server/session/subscription.h"

#include <utility>

#include "server/session/session.h"

namespace weft {

Subscription::Subscription(std::shared_ptr<Session> session, std::weak_ptr<FrameSink> sink,
                           std::int64_t next, SlowReader policy)
    : session_(std::move(session)), sink_(std::move(sink)), next_(next), policy_(policy) {}

Subscription::~Subscription() { session_->unsubscribe(*this); }

Reading Subscription::read(bool frame_wanted) { return session_->read(*this, frame_wanted); }

std::int64_t Subscription::next_frame() const {
  std::lock_guard lock(session_->mutex_);
  return next_;
}

Progress Subscription::progress() const {
  std::lock_guard lock(session_->mutex_);
  return session_->progress();
}

std::unique_ptr<Subscription> Session::subscribe(std::weak_ptr<FrameSink> sink,
                                                 std::optional<std::int64_t> start,
                                                 SlowReader policy) {
  std::unique_lock lock(mutex_);
  auto subscription = std::make_unique<Subscription>(shared_from_this(), std::move(sink),
                                                     start.value_or(latest()), policy);
  subscriptions_.push_back(subscription.get());
  if (policy == SlowReader::kHoldSession && past_holders_ && --past_holders_->count == 0)
    past_holders_.reset();
  // where each begins says what has come to it
  if (policy != SlowReader::kSkip && past_readers_ > 0 && --past_readers_ == 0) taken_.clear();
  release();
  lock.unlock();
  wake();
  return subscription;
}

void Session::unsubscribe(const Subscription& subscription) {
  {
    std::lock_guard lock(mutex_);
    std::erase(subscriptions_, &subscription);
    used_ = Clock::now();
    if (subscription.policy_ != SlowReader::kSkip) looked_at_ = Clock::now();
    release();
  }
  wake();
}

Reading Session::read(Subscription& subscription, bool frame_wanted) {
  Reading reading;
  {
    std::lock_guard lock(mutex_);
    reading.progress = progress();
    if (closed_ == Refusal::Why::kDeleted || closed_ == Refusal::Why::kTaken) {
      const bool taken = closed_ == Refusal::Why::kTaken;
      reading.kind = taken ? Reading::Kind::kTaken : Reading::Kind::kDeleted;
      return reading;
    }
    if (!frame_wanted && subscription.next_ <= latest()) return reading;
    if (subscription.policy_ == SlowReader::kSkip && subscription.next_ < latest()) {
      reading.skipped = latest() - std::exchange(subscription.next_, latest());
    }
    reading.frame = history_.find(subscription.next_);
    if (reading.frame) {
      reading.kind = Reading::Kind::kFrame;
      ++subscription.next_;
    } else if (subscription.next_ < history_.oldest()) {
      reading.kind = Reading::Kind::kExpired;
    } else if (state_ == SessionState::kFailed) {
      reading.kind = Reading::Kind::kFailed;
    }
    if (!reading.frame || !release()) return reading;
  }
  wake();
  return reading;
}

// Ends the wait. The pace begins anew: time lost is not made up for in a rush.
bool Session::release() {
  if (!held_) return false;
  held_ = false;
  if (run_) {
    run_->start_time = Clock::now();
    run_->start_frame = latest();
  }
  return true;
}

void Session::offer_to_all() {
  std::vector<std::shared_ptr<FrameSink>> sinks;
  {
    std::lock_guard lock(mutex_);
    for (const Subscription* subscription : subscriptions_) {
      if (auto sink = subscription->sink_.lock()) sinks.push_back(std::move(sink));
    }
  }
  for (const auto& sink : sinks) sink->offer();
}

}  // namespace weft

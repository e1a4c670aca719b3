#include "server/session/subscription.h"

#include <utility>

#include "server/session/session.h"

namespace weft {

Subscription::Subscription(std::shared_ptr<Session> session, FrameReader reader)
    : session_(std::move(session)), reader_(std::move(reader)) {}

Subscription::~Subscription() { session_->unsubscribe(reader_); }

Reading Subscription::read(bool frame_wanted) { return session_->read(reader_, frame_wanted); }

std::int64_t Subscription::next_frame() const {
  std::lock_guard lock(session_->mutex_);
  return reader_.next;
}

Progress Subscription::progress() const {
  std::lock_guard lock(session_->mutex_);
  return session_->progress();
}

}  // namespace weft

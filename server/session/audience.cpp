#include "server/session/audience.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace weft {

void Audience::push(std::shared_ptr<const Frame> frame, Time now) {
  history_.set_read(has_readers(now));
  history_.push(std::move(frame), first_held(now));
}

void Audience::trim(Time now) {
  history_.set_read(has_readers(now));
  history_.trim(first_held(now));
}

void Audience::add(FrameReader& reader, Time now) {
  readers_.push_back(&reader);
  if (reader.policy == SlowReader::kSkip) return;
  history_.set_read(true);
  if (reader.policy == SlowReader::kHoldSession && absent_holders_ && --absent_holders_->count == 0)
    absent_holders_.reset();
  if (absent_readers_ > 0) --absent_readers_;
  // a last mark that is no farther holds for as long
  if (!read_marks_.empty() && read_marks_.back().next <= reader.next) return;
  while (!read_marks_.empty() && read_marks_.back().next >= reader.next) read_marks_.pop_back();
  read_marks_.push_back({now, reader.next});
}

int Audience::recorders() const {
  return static_cast<int>(
      std::count_if(readers_.begin(), readers_.end(),
                    [](const FrameReader* each) { return each->policy != SlowReader::kSkip; }));
}

std::vector<std::shared_ptr<FrameSink>> Audience::sinks() const {
  std::vector<std::shared_ptr<FrameSink>> sinks;
  for (const FrameReader* reader : readers_)
    if (auto sink = reader->sink.lock()) sinks.push_back(std::move(sink));
  return sinks;
}

Audience::Found Audience::take_next(FrameReader& reader) {
  Found found;
  if (reader.policy == SlowReader::kSkip && reader.next < latest())
    found.skipped = latest() - std::exchange(reader.next, latest());
  found.frame = history_.find(reader.next);
  if (found.frame)
    ++reader.next;
  else
    found.expired = reader.next < oldest();
  return found;
}

void Audience::expect_back(const PublishLimit& left, Time until) {
  if (!left.history_from) return;
  absent_until_ = until;
  absent_readers_ = left.readers;
  absent_from_ = *left.history_from;
  if (left.holders > 0) absent_holders_ = AbsentHolders{left.holders, *left.history_from, until};
}

void Audience::forget_absent(Time now) {
  if (absent_holders_ && absent_holders_->until <= now) absent_holders_.reset();
}

std::optional<Audience::Time> Audience::holds_until(Time now) {
  forget_absent(now);
  return absent_holders_ ? std::optional(absent_holders_->until) : std::nullopt;
}

bool Audience::must_hold(Time now) {
  if (!history_.full()) return false;
  forget_absent(now);
  return (absent_holders_ && absent_holders_->held_from <= oldest()) ||
         first_wanted_by(SlowReader::kHoldSession) <= (oldest() + latest()) / 2;
}

PublishLimit Audience::limit_at(std::int64_t frame, Time now) {
  PublishLimit limit{frame, holders(now)};
  if (has_readers(now)) limit.history_from = wanted_from(now);
  limit.readers = readers(now);
  return limit;
}

bool Audience::knows_readers(const PublishLimit& limit, Time now) const {
  return has_readers(now) == limit.history_from.has_value() && readers(now) == limit.readers;
}

// Those with HOLD_SESSION, and those that may come back.
int Audience::holders(Time now) {
  forget_absent(now);
  const auto here = std::count_if(readers_.begin(), readers_.end(), [](const FrameReader* each) {
    return each->policy == SlowReader::kHoldSession;
  });
  return static_cast<int>(here) + (absent_holders_ ? absent_holders_->count : 0);
}

int Audience::readers(Time now) const {
  return recorders() + (now < absent_until_ ? absent_readers_ : 0);
}

// Whether there are recorders, or some that may come back.
bool Audience::has_readers(Time now) const {
  return recorders() > 0 || absent_holders_ || now < absent_until_;
}

// First frame that a holder still needs.
std::int64_t Audience::first_held(Time now) {
  forget_absent(now);
  const auto first = first_wanted_by(SlowReader::kHoldSession);
  return absent_holders_ ? std::min(first, absent_holders_->held_from) : first;
}

// Next frame of the slowest with that policy; the largest number where there is none.
std::int64_t Audience::first_wanted_by(SlowReader policy) const {
  auto first = std::numeric_limits<std::int64_t>::max();
  for (const FrameReader* reader : readers_)
    if (reader->policy == policy) first = std::min(first, reader->next);
  return first;
}

// The first frame that readers may want again if they are cut off, as far as it is kept. What was
// sent to them may never have come, so it is not enough that they have taken it: what they had is
// noted for as long as they may take to come back.
std::int64_t Audience::wanted_from(Time now) {
  constexpr int kMarks = 60;
  std::int64_t next =
      std::min(first_wanted_by(SlowReader::kDisconnect), first_wanted_by(SlowReader::kHoldSession));
  if (recorders() > 0 &&
      (read_marks_.empty() || now - read_marks_.back().time >= return_time_ / kMarks))
    read_marks_.push_back({now, next});
  while (read_marks_.size() > 1 && now - read_marks_[1].time >= return_time_)
    read_marks_.pop_front();
  if (!read_marks_.empty()) next = std::min(next, read_marks_.front().next);
  if (absent_readers_ > 0 && now < absent_until_) next = std::min(next, absent_from_);
  return std::clamp(next, oldest(), latest());
}

}  // namespace weft

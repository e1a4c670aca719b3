#include "server/session/history.h"

#include <cassert>
#include <utility>

namespace weft {

History::History(std::size_t max_bytes) : max_bytes_(max_bytes) {}

History::~History() {
  while (!frames_.empty()) drop_oldest();
}

void History::begin(std::shared_ptr<const Frame> frame) {
  while (!frames_.empty()) drop_oldest();
  push(std::move(frame), 0);
}

void History::push(std::shared_ptr<const Frame> frame, std::int64_t keep_from) {
  assert(frames_.empty() || frame->number == latest()->number + 1);
  frame_bytes_ += frame->bytes();
  frame->encodings.count_in(encoding_bytes_);
  frames_.push_back(std::move(frame));
  while (frames_.size() > 2 && bytes() > max_bytes_ && oldest() < keep_from) drop_oldest();
}

bool History::full() const {
  return frames_.size() >= 2 && bytes() + latest()->bytes() > max_bytes_;
}

std::shared_ptr<const Frame> History::find(std::int64_t number) const {
  if (frames_.empty() || number < oldest() || number > latest()->number) return nullptr;
  return frames_[static_cast<std::size_t>(number - oldest())];
}

void History::drop_oldest() {
  frame_bytes_ -= frames_.front()->bytes();
  frames_.front()->encodings.count_in(nullptr);
  frames_.pop_front();
}

}  // namespace weft

#include "server/session/history.h"

#include <cassert>
#include <utility>

namespace weft {

History::History(std::shared_ptr<HistoryBudget> budget)
    : budget_(std::move(budget)), bytes_(std::make_shared<ByteMeter>(budget_->meter())) {
  budget_->add(read_);
}

History::~History() {
  while (!frames_.empty()) drop_oldest();
  budget_->remove(read_);
}

void History::set_read(bool read) {
  if (read == read_) return;
  budget_->add(read);
  budget_->remove(read_);
  read_ = read;
}

void History::begin(std::shared_ptr<const Frame> frame) {
  while (!frames_.empty()) drop_oldest();
  push(std::move(frame), 0);
}

void History::push(std::shared_ptr<const Frame> frame, std::int64_t keep_from) {
  assert(frames_.empty() || frame->number == latest()->number + 1);
  bytes_->add(frame->bytes());
  frame->encodings.count_in(bytes_);
  frames_.push_back(std::move(frame));
  trim(keep_from);
}

void History::trim(std::int64_t keep_from) {
  const std::size_t share = budget_->share(read_);
  while (frames_.size() > 2 && bytes_->bytes() > share && oldest() < keep_from) drop_oldest();
}

bool History::full() const {
  return frames_.size() >= 2 && bytes_->bytes() + latest()->bytes() > budget_->share(read_);
}

std::shared_ptr<const Frame> History::find(std::int64_t number) const {
  if (frames_.empty() || number < oldest() || number > latest()->number) return nullptr;
  return frames_[static_cast<std::size_t>(number - oldest())];
}

void History::drop_oldest() {
  bytes_->remove(frames_.front()->bytes());
  frames_.front()->encodings.count_in(nullptr);
  frames_.pop_front();
}

}  // namespace weft

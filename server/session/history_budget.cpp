#include "server/session/history_budget.h"

#include <algorithm>

namespace weft {

void ByteMeter::add(std::size_t bytes) {
  bytes_ += bytes;
  if (all_) all_->add(bytes);
}

void ByteMeter::remove(std::size_t bytes) {
  bytes_ -= bytes;
  if (all_) all_->remove(bytes);
}

std::size_t HistoryBudget::share(bool read) const {
  const std::size_t weights = std::max(weights_.load(), weight(read));
  return std::min(each_, all_ / weights * weight(read));
}

}  // namespace weft

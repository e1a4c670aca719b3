#include "server/rpc/open_calls.h"

namespace weft {

OpenCalls::Ticket::Ticket(OpenCalls& calls) : calls_(calls) {
  std::lock_guard lock(calls_.mutex_);
  ++calls_.count_;
}

OpenCalls::Ticket::~Ticket() {
  std::lock_guard lock(calls_.mutex_);
  if (--calls_.count_ == 0) calls_.changed_.notify_all();
}

bool OpenCalls::wait_for_none(Clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  return changed_.wait_until(lock, deadline, [&] { return count_ == 0; });
}

}  // namespace weft

#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

namespace weft {

// A value that is made again for each turn by the thread that asks for it first; others that ask
// meanwhile wait.
class MadeOnce {
 public:
  // Precondition: turns are positive, and a new one comes when no thread is asking.
  template <class Make>
  void in(std::int64_t turn, const Make& make) {
    std::int64_t made = made_in_.load(std::memory_order_acquire);
    if (made == turn) return;
    if (made != kBeingMade &&
        made_in_.compare_exchange_strong(made, kBeingMade, std::memory_order_acquire)) {
      make();
      made_in_.store(turn, std::memory_order_release);
      return;
    }
    while (made_in_.load(std::memory_order_acquire) != turn) std::this_thread::yield();
  }

 private:
  static constexpr std::int64_t kBeingMade = -1;
  std::atomic<std::int64_t> made_in_ = 0;
};

}  // namespace weft

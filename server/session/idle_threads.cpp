#include "server/session/idle_threads.h"

#include <thread>
#include <utility>

namespace weft {
namespace {

// Waits for what is a matter of microseconds.
template <class Condition>
void spin_until(const Condition& holds) {
  constexpr int kTurns = 1000;
  for (int turn = 0; !holds(); ++turn) {
    if (turn >= kTurns) std::this_thread::yield();
  }
}

}  // namespace

IdleThreads::IdleThreads(Scheduler& scheduler, int most_threads, std::shared_ptr<HelpedTime> helped)
    : shared_(std::make_shared<Shared>()) {
  shared_->helped = std::move(helped);
  for (int threads = 1; threads < most_threads; ++threads) {
    if (!scheduler.help([shared = shared_, &scheduler] { help(*shared, scheduler); })) break;
  }
}

IdleThreads::~IdleThreads() { shared_->closed = true; }

int IdleThreads::threads() const { return 1 + shared_->helpers.load(std::memory_order_relaxed); }

void IdleThreads::run(int parts, const std::function<void(int)>& part) {
  shared_->part = &part;
  shared_->done.store(0, std::memory_order_relaxed);
  shared_->left.store(parts, std::memory_order_release);
  while (shared_->take()) {
  }
  spin_until([&] { return shared_->done.load(std::memory_order_acquire) == parts; });
}

// Runs a part that nobody has taken; false where there is none.
bool IdleThreads::Shared::take() {
  const int taken = left.fetch_sub(1, std::memory_order_acq_rel);
  if (taken <= 0) return false;
  (*part)(taken - 1);
  done.fetch_add(1, std::memory_order_release);
  return true;
}

void IdleThreads::help(Shared& shared, const Scheduler& scheduler) {
  ++shared.helpers;
  const auto begin = thread_time();
  for (bool wanted = true; wanted;) {
    spin_until([&] {
      wanted = !shared.closed && !scheduler.busy();
      return !wanted || shared.left.load(std::memory_order_relaxed) > 0;
    });
    if (wanted) shared.take();
  }
  if (shared.helped) *shared.helped += (thread_time() - begin).count();
  --shared.helpers;
}

}  // namespace weft

#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include "core/motion/thread_pool.h"
#include "server/session/processor_time.h"
#include "server/session/scheduler.h"

namespace weft {

// Threads of a scheduler that have nothing else to do while a frame is computed. They leave as soon
// as something else waits.
class IdleThreads : public ThreadPool {
 public:
  // helped: counts their time, where there is one.
  IdleThreads(Scheduler& scheduler, int most_threads, std::shared_ptr<HelpedTime> helped = {});
  ~IdleThreads() override;
  IdleThreads(const IdleThreads&) = delete;
  IdleThreads& operator=(const IdleThreads&) = delete;

  int threads() const override;
  void run(int parts, const std::function<void(int)>& part) override;

 private:
  struct Shared {
    std::atomic<int> helpers = 0;
    std::atomic<bool> closed = false;
    const std::function<void(int)>* part = nullptr;  // read by who has taken a part
    std::atomic<int> left = 0;                       // parts that nobody has taken, or below
    std::atomic<int> done = 0;                       // parts that are over
    std::shared_ptr<HelpedTime> helped = {};

    bool take();
  };
  static void help(Shared& shared, const Scheduler& scheduler);

  const std::shared_ptr<Shared> shared_;
};

}  // namespace weft

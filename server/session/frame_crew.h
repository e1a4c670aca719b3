#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include "core/motion/crew.h"
#include "server/session/scheduler.h"

namespace weft {

// Threads of a scheduler that have nothing else to do while a frame is computed. They leave as soon
// as something else waits.
class FrameCrew : public Crew {
 public:
  FrameCrew(Scheduler& scheduler, int most_hands);
  ~FrameCrew() override;
  FrameCrew(const FrameCrew&) = delete;
  FrameCrew& operator=(const FrameCrew&) = delete;

  int hands() const override;
  void run(int parts, const std::function<void(int)>& part) override;

 private:
  struct Shared {
    std::atomic<int> helpers = 0;
    std::atomic<bool> closed = false;
    const std::function<void(int)>* part = nullptr;  // read by who has taken a part
    std::atomic<int> left = 0;                       // parts that nobody has taken, or below
    std::atomic<int> done = 0;                       // parts that are over

    bool take();
  };
  static void help(Shared& shared, const Scheduler& scheduler);

  const std::shared_ptr<Shared> shared_;
};

}  // namespace weft

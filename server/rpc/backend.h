#pragma once

#include <atomic>
#include <cstddef>

#include "server/session/limits.h"
#include "server/session/registry.h"
#include "server/session/scheduler.h"

namespace weft {

// What the services share. The registry goes first, while sessions can still reach the scheduler.
struct Backend {
  Backend(const Limits& given, int threads)
      : limits(given),
        worker_threads(threads),
        scheduler(threads),
        registry(static_cast<std::size_t>(given.max_sessions)) {}

  const Limits limits;
  const int worker_threads;
  std::atomic<bool> draining = false;  // sessions are not created or changed any more
  Scheduler scheduler;
  Registry registry;
};

}  // namespace weft

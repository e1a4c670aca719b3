#pragma once

#include <spdlog/spdlog.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <utility>

#include "server/rpc/open_calls.h"
#include "server/rpc/requests.h"
#include "server/session/limits.h"
#include "server/session/registry.h"
#include "server/session/scheduler.h"
#include "server/store/store.h"

namespace weft {

// What the services share. The registry goes first, while sessions can still reach the scheduler.
// Scenes are planned on a thread of their own, so that a large one holds up no session.
struct Backend {
  Backend(const Limits& given, int threads, std::chrono::milliseconds snapshots_after,
          std::unique_ptr<SessionStore> sessions)
      : limits(given),
        worker_threads(threads),
        snapshot_after(snapshots_after),
        scheduler(threads),
        store(std::move(sessions)),
        registry(static_cast<std::size_t>(given.max_sessions)) {}

  SessionHost host() {
    return {scheduler, stats, static_cast<std::size_t>(limits.history_bytes_per_session),
            [](const std::string& line) { spdlog::warn(line); }, snapshot_after};
  }

  const Limits limits;
  const int worker_threads;
  const std::chrono::milliseconds snapshot_after;
  std::atomic<bool> draining = false;  // sessions are not created or changed any more
  OpenCalls calls;
  Requests requests;
  Stats stats;
  Scheduler scheduler;
  Scheduler planner{1};
  const std::unique_ptr<SessionStore> store;
  Registry registry;
};

}  // namespace weft

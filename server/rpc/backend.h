#pragma once

#include <spdlog/spdlog.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "server/rpc/access.h"
#include "server/rpc/open_calls.h"
#include "server/rpc/requests.h"
#include "server/rpc/slow_calls.h"
#include "server/session/limits.h"
#include "server/session/registry.h"
#include "server/session/scheduler.h"
#include "server/store/assets.h"
#include "server/store/store.h"

namespace weft {

// Who calls a stream, and his share of them.
struct StreamCaller {
  Caller caller;
  Quota::Share share;
};

// Sessions go on for so long while a database that servers share is away.
inline constexpr std::chrono::seconds kSharedLimitInterval{3};

// What the services share. The registry goes first, while sessions can still reach the scheduler.
// Scenes are planned on a thread of their own, so that a large one holds up no session.
struct Backend {
  Backend(const Limits& given, int threads, std::chrono::milliseconds snapshots_after,
          std::unique_ptr<SessionStore> sessions, std::string name, Access callers)
      : limits(given),
        worker_threads(threads),
        snapshot_after(snapshots_after),
        access(std::move(callers)),
        streams({"streams", given.max_streams},
                {"streams_per_principal", given.max_streams_per_principal}),
        scheduler(threads),
        store(std::move(sessions)),
        replica(std::move(name)),
        registry(given) {}

  SessionHost host() {
    return {scheduler,
            stats,
            history,
            [](const std::string& line) { spdlog::warn(line); },
            snapshot_after,
            static_cast<std::size_t>(limits.max_snapshots_per_session),
            store->is_shared() ? kSharedLimitInterval : SessionHost::kLimitInterval};
  }

  // The caller of a stream, or why there is none.
  std::variant<StreamCaller, grpc::Status> admit(const grpc::ServerContextBase& context);

  const Limits limits;
  const int worker_threads;
  const std::chrono::milliseconds snapshot_after;
  const Access access;
  Quota streams;
  std::atomic<bool> draining = false;  // sessions are not created or changed any more
  OpenCalls calls;
  Requests requests;
  Stats stats;
  const std::shared_ptr<HistoryBudget> history =
      std::make_shared<HistoryBudget>(static_cast<std::size_t>(limits.max_total_history_bytes),
                                      static_cast<std::size_t>(limits.history_bytes_per_session));
  Scheduler scheduler;
  SlowCalls planner{"creations", "too many sessions are being created"};
  SlowCalls large_planner{"creations", "too many large sessions are being created"};
  SlowCalls garments{"garments", "too many garments are being built"};
  SlowCalls store_calls{"store_calls", "too many calls wait for the store"};
  SlowCalls asset_calls{"asset_calls", "too many calls wait for assets"};
  std::mutex claiming;
  const std::unique_ptr<SessionStore> store;
  const std::string replica;  // among servers that share the store; else empty
  Registry registry;
};

}  // namespace weft

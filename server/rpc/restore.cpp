#include "server/rpc/restore.h"

#include <spdlog/spdlog.h>

#include <atomic>
#include <thread>
#include <utility>
#include <vector>

#include "server/convert/names.h"
#include "server/convert/numerics.h"
#include "server/rpc/assets.h"
#include "server/rpc/server_service.h"

namespace weft {

void add_damaged(Backend& backend, const DamagedSession& damaged) {
  spdlog::error("{} is damaged: {}", session_name(damaged.id), damaged.why);
  backend.registry.restore(damaged.id, {damaged.uid, damaged.why, damaged.owner});
}

void restore_session(Backend& backend, LeftSession left) {
  const SessionIdentity& identity = left.session.identity;
  Simulation simulation(std::move(left.session.scene));
  if (simulation.refusal()) {
    return add_damaged(
        backend, {identity.id, identity.uid, "this version cannot step its scene", identity.owner});
  }
  if (identity.numerics_id != numerics_id()) {
    spdlog::warn("{} was created with numerics {}; its frames may differ in their last bits now",
                 session_name(identity.id), identity.numerics_id);
  }
  const auto session =
      std::make_shared<Session>(identity, std::move(simulation), backend.host(),
                                backend.store->log_of(identity.uid, left.saved.entries()));
  left.saved.snapshot = backend.store->snapshot(identity.uid, left.saved);
  if (left.saved.snapshot && left.saved.snapshot->numerics_id != numerics_id()) {
    spdlog::warn("{} goes on from frame {}, which numerics {} computed", session_name(identity.id),
                 left.saved.snapshot->simulation.frame, left.saved.snapshot->numerics_id);
  }
  if (!session->restore(std::move(left.saved))) {
    return add_damaged(backend,
                       {identity.id, identity.uid,
                        "no snapshot of it can be used, and its log does not reach back to "
                        "frame 0",
                        identity.owner});
  }
  backend.registry.restore(session);
}

void restore_sessions(Backend& backend) {
  LeftBehind left = backend.store->load();
  count_assets(backend);
  for (const auto& [request, uid] : left.requests) backend.requests.remember(request, uid);
  for (const auto& damaged : left.damaged) add_damaged(backend, damaged);

  std::atomic<std::size_t> next = 0;
  std::vector<std::jthread> threads;
  for (int i = 0; i < backend.worker_threads; ++i) {
    threads.emplace_back([&] {
      for (std::size_t k = next++; k < left.sessions.size(); k = next++) {
        restore_session(backend, std::move(left.sessions[k]));
      }
    });
  }
  threads.clear();  // joins
  if (!left.sessions.empty()) spdlog::info("sessions restored: {}", left.sessions.size());
}

}  // namespace weft

#include "server/rpc/find.h"

#include <spdlog/spdlog.h>

#include <cstddef>
#include <limits>
#include <mutex>
#include <utility>

#include "server/convert/names.h"
#include "server/rpc/errors.h"
#include "server/rpc/restore.h"

namespace weft {
namespace {

FoundSession in_registry(const Registry& registry, const Caller& caller, const std::string& name) {
  const std::string id = id_of(name);
  if (auto session = registry.find(id); session && caller.may_use(*session)) return session;
  const auto damaged = registry.damaged(id);
  const bool known = caller.is_admin || (damaged && damaged->owner == caller.principal);
  if (!known) return errors::session_not_yours(name);
  if (damaged) return errors::session_damaged(name, damaged->why);
  return errors::session_not_found(name);
}

}  // namespace

std::optional<FoundSession> find_here(const Backend& backend, const Caller& caller,
                                      const std::string& name, const std::string& field) {
  const std::string id = id_of(name);
  if (!is_session_id(id)) {
    return errors::field_invalid(field, "\"" + name +
                                            "\" is not sessions/ and 1 to 63 characters of a-z, "
                                            "0-9 and -, beginning with a letter");
  }
  const bool here = backend.registry.find(id) != nullptr || backend.registry.damaged(id);
  if (!here && backend.store->has_others()) return std::nullopt;
  return in_registry(backend.registry, caller, name);
}

FoundSession find_anywhere(Backend& backend, const Caller& caller, const std::string& name,
                           const std::string& field) try {
  const std::lock_guard one_at_a_time(backend.claiming);
  if (auto found = find_here(backend, caller, name, field)) return *std::move(found);
  if (backend.draining) return errors::server_draining();
  const std::string id = id_of(name);
  Claim claim = backend.store->claim(id);
  if (const auto* elsewhere = std::get_if<Elsewhere>(&claim)) {
    return caller.may_use(elsewhere->owner) ? errors::wrong_replica(name, elsewhere->replica)
                                            : errors::session_not_yours(name);
  }
  if (auto* left = std::get_if<LeftSession>(&claim)) {
    if (backend.store->is_shared()) spdlog::info("{} is taken over", name);
    restore_session(backend, std::move(*left));
    ++backend.stats.taken_over;
  } else if (const auto* damaged = std::get_if<DamagedSession>(&claim)) {
    add_damaged(backend, *damaged);
  }
  return in_registry(backend.registry, caller, name);
} catch (const StoreError& error) {
  return errors::store_unreachable(error.what());
}

void find_elsewhere(Backend& backend, const Caller& caller, const std::string& name, Found then) {
  const auto found = std::make_shared<std::shared_ptr<Session>>();
  backend.store_calls.ask(
      [&backend, caller, name, found] {
        FoundSession result = find_anywhere(backend, caller, name);
        if (const auto* error = std::get_if<grpc::Status>(&result)) return *error;
        *found = std::get<std::shared_ptr<Session>>(std::move(result));
        return grpc::Status::OK;
      },
      [found, then = std::move(then)](const grpc::Status& status) {
        then(status.ok() ? FoundSession(*found) : FoundSession(status));
      });
}

void adopt_session(Backend& backend, const std::string& id) {
  const Caller admin{"", true};
  find_elsewhere(backend, admin, session_name(id), [](const FoundSession&) {});
}

void evict_sessions(Backend& backend, std::chrono::duration<double> unused) {
  for (const auto& session : backend.registry.list("", std::numeric_limits<std::size_t>::max())) {
    const std::lock_guard one_at_a_time(backend.claiming);
    if (!session->evict(unused)) continue;
    try {
      backend.store->let_go(session->identity());
    } catch (const StoreError& error) {
      spdlog::warn("{} cannot be let go: {}", session_name(session->id()), error.what());
    }
    give_away(backend, session);
  }
}

void give_away(Backend& backend, const std::shared_ptr<Session>& session) {
  if (backend.registry.erase(session, Refusal::Why::kEvicted)) ++backend.stats.given_away;
}

}  // namespace weft

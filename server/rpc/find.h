#pragma once

#include <grpcpp/support/status.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "server/rpc/backend.h"

namespace weft {

// The caller's session, or why there is none. Admins find every session. To others, one that is not
// theirs looks as if there were none.
using FoundSession = std::variant<std::shared_ptr<Session>, grpc::Status>;

// The session called `name`, where that is known at once; nullopt: it may be another server's.
// `field` is where the request names it.
std::optional<FoundSession> find_here(const Backend& backend, const Caller& caller,
                                      const std::string& name, const std::string& field = "name");

// The same for all sessions: this server takes it over where no living one has it. Waits for the
// store.
FoundSession find_anywhere(Backend& backend, const Caller& caller, const std::string& name,
                           const std::string& field = "name");

// The same without waiting: `then` is called once, from any thread, where it must not wait either.
using Found = std::function<void(const FoundSession&)>;
void find_elsewhere(Backend& backend, const Caller& caller, const std::string& name, Found then);

// Takes over a session whose server died, in its turn.
void adopt_session(Backend& backend, const std::string& id);

// Ends a session that is not this server's any more.
void give_away(Backend& backend, const std::shared_ptr<Session>& session);

// Leaves sessions that are paused and were not used for so long to the store alone.
void evict_sessions(Backend& backend, std::chrono::duration<double> unused);

}  // namespace weft

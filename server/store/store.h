#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/model/scene.h"
#include "server/session/session.h"
#include "weft/v1/scene.pb.h"

namespace weft {

class Assets;

// What is kept of a session from its beginning on.
struct KeptSession {
  SessionIdentity identity;
  Scene scene;
};

// A session that an earlier process left.
struct LeftSession {
  KeptSession session;
  SavedSession saved;
};

// One whose data cannot be trusted.
struct DamagedSession {
  std::string id, uid;
  std::string why;
  std::optional<std::string> owner = {};  // principal, where that can be trusted
};

// A creation or deletion that was named, and the uid of its session.
struct KeptRequest {
  Request request;
  std::string uid;
};

// The same with the id of its session, where that is still there.
struct CarriedOut {
  KeptRequest kept;
  std::string id;
};

struct LeftBehind {
  std::vector<LeftSession> sessions;
  std::vector<DamagedSession> damaged;
  std::vector<KeptRequest> requests;  // oldest first
};

// A session that another server has.
struct Elsewhere {
  std::string replica;  // that server
  std::string owner;    // principal
};

// What is known of a session that this server does not have: nothing, who has it, or what it goes
// on from here, since it is this server's now.
using Claim = std::variant<std::monostate, Elsewhere, LeftSession, DamagedSession>;

// A session of any server.
struct ListedSession {
  SessionIdentity identity;
  v1::Scene scene;      // as it was created
  std::string replica;  // that has it; empty: none
};

class StoreError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// This server has no session of that name, but the store has.
class SessionExists : public StoreError {
 public:
  explicit SessionExists(std::string principal)
      : StoreError("there is one of that name"), owner(std::move(principal)) {}
  std::string owner;  // principal
};

// Where sessions outlive the server. Thread-safe.
class SessionStore {
 public:
  virtual ~SessionStore() = default;

  // What an earlier process left. Called once, first.
  virtual LeftBehind load() = 0;

  // Keeps a new session, made by `creation`, and waits until it is safe. It begins with its scene,
  // or at a snapshot that says to come after one entry of a log, which is forgotten. Throws
  // StoreError.
  virtual void add(const KeptSession& session, const Request& creation,
                   const SessionSnapshot* beginning) = 0;

  // A snapshot that was kept on demand. Throws StoreError where it is missing or damaged.
  virtual SessionSnapshot named_snapshot(const std::string& uid, const std::string& id) = 0;

  // The newest sound snapshot of a session at most at the frame of its limit's history, if there is
  // one; else, where its log does not reach back to frame 0, the oldest sound one after that. What
  // is newer is removed.
  virtual std::optional<SessionSnapshot> snapshot(const std::string& uid,
                                                  const SavedSession& saved) = 0;

  // Where the session's log goes on after so many entries. The store outlives it.
  virtual std::unique_ptr<SessionLog> log_of(const std::string& uid, std::int64_t entries) = 0;

  // Forgets a session, if it is there; `written` as in SessionLog.
  virtual void erase(const std::string& uid, const Request& deletion,
                     const SessionLog::Written& written) = 0;

  // What sessions name. A session that is added uses those that its scene names, which its owner
  // has; one that is erased does no more.
  virtual Assets& assets() = 0;

  // What follows is for sessions that the store has and this server has not. All of it waits for
  // the store, and throws StoreError.

  // Whether there may be such.
  virtual bool has_others() const { return false; }

  // Such a session, by its id; taken over where no living server has it.
  virtual Claim claim(const std::string& /*id*/) { return {}; }

  // Makes one such of a session that nothing is written of any more.
  virtual void let_go(const SessionIdentity& /*identity*/) {}

  // In order of id, at most `count` of those after `after`; of one owner, or of all.
  virtual std::vector<ListedSession> list(const std::string& /*after*/, std::size_t /*count*/,
                                          const std::optional<std::string>& /*owner*/) {
    return {};
  }

  // Whether several servers share the store, each session being one server's at a time.
  virtual bool is_shared() const { return false; }

  // A creation or deletion that any of the servers carried out.
  virtual std::optional<CarriedOut> find_request(const std::string& /*id*/) { return {}; }

  // Has every session be heard of that another server took over, by uid, and of sessions whose
  // server died, by id; from a thread of the store's, which must not be held up. Called once.
  struct Watch {
    std::function<void(const std::string& uid)> taken;
    std::function<void(const std::string& id)> orphaned;
  };
  virtual void watch(Watch /*watch*/) {}

  // Lets go of every session, for other servers to take over, and is used no more.
  virtual void leave() {}
};

// Keeps nothing: sessions end with the server.
std::unique_ptr<SessionStore> make_no_store();

// Keeps sessions in an SQLite file in the directory, which is made where it is missing. Throws
// StoreError where the file cannot be used, or another process uses it.
std::unique_ptr<SessionStore> open_sqlite_store(const std::string& directory);

// Keeps sessions in a PostgreSQL database that several servers share, in its schema "weft", which
// is made where it is missing. `url` is a connection string or URI of libpq; `replica` is what
// other servers call this one. Throws StoreError where the database cannot be used.
std::unique_ptr<SessionStore> open_postgres_store(const std::string& url,
                                                  const std::string& replica);

}  // namespace weft

#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/model/scene.h"
#include "server/session/session.h"

namespace weft {

// What is kept of a session from its beginning on.
struct KeptSession {
  SessionIdentity identity;
  Scene scene;
};

// A session that an earlier process left.
struct LeftSession {
  KeptSession session;
  SessionPast past;
};

// One whose data cannot be trusted.
struct DamagedSession {
  std::string id, uid;
  std::string why;
};

// A creation or deletion that was named, and the uid of its session.
struct KeptRequest {
  Request request;
  std::string uid;
};

struct LeftBehind {
  std::vector<LeftSession> sessions;
  std::vector<DamagedSession> damaged;
  std::vector<KeptRequest> requests;  // oldest first
};

class StoreError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
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

  // The newest sound snapshot of a session at most at the frame of its reach's history, if there is
  // one; else, where its log does not reach back to frame 0, the oldest sound one after that. What
  // is newer is removed.
  virtual std::optional<SessionSnapshot> snapshot(const std::string& uid,
                                                  const SessionPast& past) = 0;

  // Where the session's log goes on after so many entries. The store outlives it.
  virtual std::unique_ptr<SessionLog> log_of(const std::string& uid, std::int64_t entries) = 0;

  // Forgets a session, if it is there; `written` as in SessionLog.
  virtual void erase(const std::string& uid, const Request& deletion,
                     const SessionLog::Written& written) = 0;
};

// Keeps nothing: sessions end with the server.
std::unique_ptr<SessionStore> make_no_store();

// Keeps sessions in an SQLite file in the directory, which is made where it is missing. Throws
// StoreError where the file cannot be used, or another process uses it.
std::unique_ptr<SessionStore> open_sqlite_store(const std::string& directory);

}  // namespace weft

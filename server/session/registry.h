#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/session/limits.h"
#include "server/session/quota.h"
#include "server/session/session.h"

namespace weft {

// The sessions of a server by id, as many and as large as its limits allow. Thread-safe.
class Registry {
 public:
  // Why a session cannot be added: its id is taken, there are too many, or it is closed.
  struct Exists {
    std::string owner;  // who has it
  };
  struct Closed {};
  using Refused = std::variant<Exists, Quota::Excess, Closed>;

  explicit Registry(const Limits& limits);

  // Why a session like this could not be added; nullopt: it could.
  std::optional<Refused> refusal(const std::string& id, const std::string& owner,
                                 std::int64_t particles) const;
  std::optional<Refused> add(std::shared_ptr<Session> session);

  // Of an earlier process: they may exceed the limits.
  void restore(std::shared_ptr<Session> session);
  // Something that has the name of a session but is none.
  struct Damaged {
    std::string uid;
    std::string why;
    std::optional<std::string> owner;  // where that is known
  };
  void restore(const std::string& id, Damaged damaged);
  std::optional<Damaged> damaged(const std::string& id) const;
  void erase_damaged(const std::string& id);

  std::shared_ptr<Session> find(const std::string& id) const;  // or nullptr

  std::shared_ptr<Session> find_uid(const std::string& uid) const;  // or nullptr

  // In order of id, at most `count` of those after `after`; of one owner, or of all.
  std::vector<std::shared_ptr<Session>> list(const std::string& after, std::size_t count,
                                             const std::optional<std::string>& owner = {}) const;
  std::size_t size() const;

  // Takes a session out and ends it; false where it is not one of them.
  bool erase(const std::shared_ptr<Session>& session, Refusal::Why why = Refusal::Why::kDeleted);

  // Ends every session, and adds none any more. They can still be found.
  void close(Refusal::Why why);

 private:
  struct Entry {
    std::shared_ptr<Session> session;
    Quota::Share of_sessions, of_particles;
  };
  // with the mutex held
  std::optional<Refused> refusal_locked(const std::string& id, const std::string& owner,
                                        std::int64_t particles) const;
  void insert(std::shared_ptr<Session> session);

  Quota session_quota_, particle_quota_;
  mutable std::mutex mutex_;
  std::map<std::string, Entry> sessions_;
  std::map<std::string, Damaged> damaged_;
  bool closed_ = false;
};

}  // namespace weft

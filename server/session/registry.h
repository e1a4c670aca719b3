#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/session/session.h"

namespace weft {

// The sessions of a server by id, at most `max_sessions`. Thread-safe.
class Registry {
 public:
  enum class Refused { kExists, kFull, kClosed };

  explicit Registry(std::size_t max_sessions) : max_sessions_(max_sessions) {}

  // Why a session of this id could not be added; nullopt: it could.
  std::optional<Refused> refusal(const std::string& id) const;
  std::optional<Refused> add(std::shared_ptr<Session> session);

  // Of an earlier process: more than `max_sessions` may be.
  void restore(std::shared_ptr<Session> session);
  // Something that has the name of a session but is none.
  struct Damaged {
    std::string uid;
    std::string why;
  };
  void restore(const std::string& id, Damaged damaged);
  std::optional<Damaged> damaged(const std::string& id) const;
  void erase_damaged(const std::string& id);

  std::shared_ptr<Session> find(const std::string& id) const;  // or nullptr

  std::shared_ptr<Session> find_uid(const std::string& uid) const;  // or nullptr

  // In order of id, at most `count` of those after `after`.
  std::vector<std::shared_ptr<Session>> list(const std::string& after, std::size_t count) const;
  std::size_t size() const;

  // Takes a session out and ends it; false where it is not one of them.
  bool erase(const std::shared_ptr<Session>& session);

  // Ends every session, and adds none any more. They can still be found.
  void close(Refusal::Why why);

 private:
  std::optional<Refused> refusal_locked(const std::string& id) const;

  std::size_t max_sessions_;
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Session>> sessions_;
  std::map<std::string, Damaged> damaged_;
  bool closed_ = false;
};

}  // namespace weft

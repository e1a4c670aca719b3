#include "server/session/registry.h"

#include <utility>

namespace weft {

std::optional<Registry::Refused> Registry::refusal(const std::string& id) const {
  std::lock_guard lock(mutex_);
  return refusal_locked(id);
}

std::optional<Registry::Refused> Registry::add(std::shared_ptr<Session> session) {
  std::lock_guard lock(mutex_);
  auto refused = refusal_locked(session->id());
  if (!refused) sessions_.emplace(session->id(), std::move(session));
  return refused;
}

void Registry::restore(std::shared_ptr<Session> session) {
  std::lock_guard lock(mutex_);
  const std::string id = session->id();
  sessions_.emplace(id, std::move(session));
}

void Registry::restore(const std::string& id, Damaged damaged) {
  std::lock_guard lock(mutex_);
  damaged_.emplace(id, std::move(damaged));
}

std::optional<Registry::Damaged> Registry::damaged(const std::string& id) const {
  std::lock_guard lock(mutex_);
  const auto found = damaged_.find(id);
  return found == damaged_.end() ? std::nullopt : std::optional(found->second);
}

void Registry::erase_damaged(const std::string& id) {
  std::lock_guard lock(mutex_);
  damaged_.erase(id);
}

std::optional<Registry::Refused> Registry::refusal_locked(const std::string& id) const {
  if (closed_) return Refused::kClosed;
  if (sessions_.contains(id) || damaged_.contains(id)) return Refused::kExists;
  if (sessions_.size() >= max_sessions_) return Refused::kFull;
  return std::nullopt;
}

std::shared_ptr<Session> Registry::find(const std::string& id) const {
  std::lock_guard lock(mutex_);
  const auto found = sessions_.find(id);
  return found == sessions_.end() ? nullptr : found->second;
}

std::shared_ptr<Session> Registry::find_uid(const std::string& uid) const {
  std::lock_guard lock(mutex_);
  for (const auto& [id, session] : sessions_) {
    if (session->uid() == uid) return session;
  }
  return nullptr;
}

std::vector<std::shared_ptr<Session>> Registry::list(const std::string& after,
                                                     std::size_t count) const {
  std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<Session>> sessions;
  for (auto next = sessions_.upper_bound(after); next != sessions_.end() && sessions.size() < count;
       ++next) {
    sessions.push_back(next->second);
  }
  return sessions;
}

std::size_t Registry::size() const {
  std::lock_guard lock(mutex_);
  return sessions_.size();
}

bool Registry::erase(const std::shared_ptr<Session>& session) {
  {
    std::lock_guard lock(mutex_);
    const auto found = sessions_.find(session->id());
    if (found == sessions_.end() || found->second != session) return false;
    sessions_.erase(found);
  }
  session->close(Refusal::Why::kDeleted);
  return true;
}

void Registry::close(Refusal::Why why) {
  std::map<std::string, std::shared_ptr<Session>> sessions;
  {
    std::lock_guard lock(mutex_);
    closed_ = true;
    sessions = sessions_;
  }
  for (const auto& [id, session] : sessions) session->close(why);
}

}  // namespace weft

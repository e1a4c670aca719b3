#include "server/session/registry.h"

#include <utility>

namespace weft {

Registry::Registry(const Limits& limits)
    : session_quota_({"sessions", limits.max_sessions},
                     {"sessions_per_principal", limits.max_sessions_per_principal}),
      particle_quota_({"total_particles", limits.max_total_particles},
                      {"particles_per_principal", limits.max_particles_per_principal}) {}

std::optional<Registry::Refused> Registry::refusal(const std::string& id, const std::string& owner,
                                                   std::int64_t particles) const {
  std::lock_guard lock(mutex_);
  return refusal_locked(id, owner, particles);
}

std::optional<Registry::Refused> Registry::add(std::shared_ptr<Session> session) {
  std::lock_guard lock(mutex_);
  auto refused = refusal_locked(session->id(), session->owner(), session->particle_count());
  if (!refused) insert(std::move(session));
  return refused;
}

void Registry::restore(std::shared_ptr<Session> session) {
  std::lock_guard lock(mutex_);
  insert(std::move(session));
}

void Registry::insert(std::shared_ptr<Session> session) {
  const std::string& id = session->id();
  auto of_sessions = session_quota_.hold(session->owner(), 1);
  auto of_particles = particle_quota_.hold(session->owner(), session->particle_count());
  sessions_.emplace(id, Entry{session, std::move(of_sessions), std::move(of_particles)});
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

std::optional<Registry::Refused> Registry::refusal_locked(const std::string& id,
                                                          const std::string& owner,
                                                          std::int64_t particles) const {
  if (closed_) return Closed{};
  if (const auto found = sessions_.find(id); found != sessions_.end())
    return Exists{found->second.session->owner()};
  if (const auto found = damaged_.find(id); found != damaged_.end())
    return Exists{found->second.owner.value_or("")};
  if (const auto excess = session_quota_.excess(owner, 1)) return *excess;
  if (const auto excess = particle_quota_.excess(owner, particles)) return *excess;
  return std::nullopt;
}

std::shared_ptr<Session> Registry::find(const std::string& id) const {
  std::lock_guard lock(mutex_);
  const auto found = sessions_.find(id);
  return found == sessions_.end() ? nullptr : found->second.session;
}

std::shared_ptr<Session> Registry::find_uid(const std::string& uid) const {
  std::lock_guard lock(mutex_);
  for (const auto& [id, entry] : sessions_) {
    if (entry.session->uid() == uid) return entry.session;
  }
  return nullptr;
}

std::vector<std::shared_ptr<Session>> Registry::list(
    const std::string& after, std::size_t count, const std::optional<std::string>& owner) const {
  std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<Session>> sessions;
  for (auto next = sessions_.upper_bound(after); next != sessions_.end() && sessions.size() < count;
       ++next) {
    if (!owner || next->second.session->owner() == *owner) sessions.push_back(next->second.session);
  }
  return sessions;
}

std::size_t Registry::size() const {
  std::lock_guard lock(mutex_);
  return sessions_.size();
}

bool Registry::erase(const std::shared_ptr<Session>& session, Refusal::Why why) {
  {
    std::lock_guard lock(mutex_);
    const auto found = sessions_.find(session->id());
    if (found == sessions_.end() || found->second.session != session) return false;
    sessions_.erase(found);
  }
  session->close(why);
  return true;
}

void Registry::close(Refusal::Why why) {
  std::vector<std::shared_ptr<Session>> sessions;
  {
    std::lock_guard lock(mutex_);
    closed_ = true;
    for (const auto& [id, entry] : sessions_) sessions.push_back(entry.session);
  }
  for (const auto& session : sessions) session->close(why);
}

}  // namespace weft

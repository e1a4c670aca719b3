#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <set>
#include <string>

namespace weft {

// Under which a server has a session, and writes of it are taken.
struct Tenure {
  std::int64_t owner = 0;
  std::int64_t epoch = 0;
};

// The sessions that a server has. Thread-safe.
class Tenures {
 public:
  void set(const std::string& uid, const Tenure& tenure) {
    std::lock_guard lock(mutex_);
    tenures_[uid] = tenure;
  }
  // An epoch that no session has, where it is not one of them.
  Tenure of(const std::string& uid) const {
    std::lock_guard lock(mutex_);
    const auto found = tenures_.find(uid);
    return found == tenures_.end() ? Tenure{} : found->second;
  }
  bool erase(const std::string& uid) {
    std::lock_guard lock(mutex_);
    return tenures_.erase(uid) > 0;
  }
  std::set<std::string> uids() const {
    std::lock_guard lock(mutex_);
    std::set<std::string> uids;
    for (const auto& [uid, tenure] : tenures_) uids.insert(uid);
    return uids;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::string, Tenure> tenures_;
};

}  // namespace weft

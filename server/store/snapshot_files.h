#pragma once

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/session/log.h"
#include "server/session/scheduler.h"
#include "server/session/snapshot.h"

namespace weft {

// Snapshots of sessions: a directory each, a file a snapshot, written on a thread of their own.
// What cannot be written or read is said in the log, and done without. Thread-safe.
class SnapshotFiles {
 public:
  // Most that are kept of a session.
  static constexpr std::size_t kMost = 5;

  explicit SnapshotFiles(std::filesystem::path directory);

  // As SessionLog::offer().
  bool write(const std::string& uid, const SessionLog::Take& take,
             std::optional<std::int64_t> history_from);

  // The newest sound one, at most at `not_after`. Newer ones are removed.
  std::optional<SessionSnapshot> read(const std::string& uid,
                                      std::optional<std::int64_t> not_after) const;

  void erase(const std::string& uid);
  // Removes those of other sessions.
  void keep_only(const std::set<std::string>& uids);

 private:
  const std::filesystem::path directory_;
  std::mutex mutex_;
  std::set<std::string> writing_;  // sessions
  Scheduler thread_{1};
};

// Which of a session's snapshots no restart will need, given frames in ascending order: all but the
// last two, the last one not after `history_from`, and some between them.
std::vector<std::int64_t> superfluous(std::vector<std::int64_t> frames,
                                      std::optional<std::int64_t> history_from);

}  // namespace weft

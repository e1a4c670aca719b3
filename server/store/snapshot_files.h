#pragma once

#include <compare>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/session/log.h"
#include "server/session/scheduler.h"
#include "server/session/snapshot.h"

namespace weft {

// Where in a session's life a snapshot was taken.
struct SnapshotPlace {
  std::int64_t frame = 0;
  std::int64_t entries = 0;  // of the log, that were carried out before it
  std::strong_ordering operator<=>(const SnapshotPlace&) const = default;
};

// Snapshots of sessions: a directory each, a file a snapshot, written on a thread of their own.
// What cannot be written or read is said in the log, and done without. Thread-safe.
class SnapshotFiles {
 public:
  // Most that are kept of a session.
  static constexpr std::size_t kMost = 6;
  // Most entries of the log that restarts repeat so that readers find every frame again.
  static constexpr std::int64_t kMostEntries = 10'000;

  // Called when no restart will need the entries of the log before these any more.
  using Forget = std::function<void(std::int64_t entries)>;

  explicit SnapshotFiles(std::filesystem::path directory);

  // As SessionLog::offer().
  bool write(const std::string& uid, const SessionLog::Take& take, std::int64_t oldest,
             const Forget& forget);

  // The newest sound one at most at frame `not_after`; else, where the `first` entries of the log
  // were forgotten, the oldest sound one after it. Newer ones are removed.
  std::optional<SessionSnapshot> read(const std::string& uid, std::optional<std::int64_t> not_after,
                                      std::int64_t first) const;

  // Writes the first one of a session, and waits until it is safe. Throws StoreError.
  void begin(const std::string& uid, const SessionSnapshot& snapshot);

  // As SessionLog::keep(), drop() and SessionStore::named_snapshot().
  void keep(const std::string& uid, const std::string& id,
            std::shared_ptr<const SessionSnapshot> snapshot, const SessionLog::Kept& kept);
  void drop(const std::string& uid, const std::string& id);
  SessionSnapshot read(const std::string& uid, const std::string& id) const;
  // Those that were kept so and came before so many entries of the log, in order of frame. Later
  // ones are removed: nobody was told of them.
  std::vector<NamedSnapshot> named(const std::string& uid, std::int64_t entries) const;

  void erase(const std::string& uid);
  // Removes those of other sessions.
  void keep_only(const std::set<std::string>& uids);

 private:
  const std::filesystem::path directory_;
  std::mutex mutex_;
  std::set<std::string> writing_;  // sessions
  Scheduler thread_{1};
};

// Which of a session's snapshots no restart will need, given in ascending order: all but the last
// two, the last two not after frame `oldest`, and some between them.
std::vector<SnapshotPlace> superfluous(std::vector<SnapshotPlace> places, std::int64_t oldest);

}  // namespace weft

#pragma once

#include <compare>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/session/log.h"
#include "server/session/scheduler.h"
#include "server/session/snapshot.h"

namespace weft {

// Where snapshots are kept: bytes by session and name. A name is "NAME" or "named/NAME", those on
// demand. Thread-safe.
class SnapshotShelf {
 public:
  struct Item {
    std::string name;  // within its folder
    std::int64_t bytes = 0;
  };
  enum class Folder { kLatest, kNamed };

  virtual ~SnapshotShelf() = default;

  // What it has of a session.
  virtual std::vector<Item> list(const std::string& uid, Folder folder) = 0;
  // Waits until it is safe: there whole, or not at all. Throws StoreError.
  virtual void write(const std::string& uid, const std::string& name, const std::string& bytes) = 0;
  // Throws StoreError where there is none.
  virtual std::string read(const std::string& uid, const std::string& name) = 0;
  // What cannot be removed is said in the log.
  virtual void remove(const std::string& uid, const std::string& name) = 0;
  virtual void remove_all(const std::string& uid) = 0;
  // For people.
  virtual std::string place_of(const std::string& uid, const std::string& name) const = 0;
};

// Where in a session's life a snapshot was taken.
struct SnapshotPlace {
  std::int64_t frame = 0;
  std::int64_t entries = 0;  // of the log, that were carried out before it
  std::strong_ordering operator<=>(const SnapshotPlace&) const = default;
};

// Which snapshots of sessions are kept, written on a thread of their own. What cannot be written or
// read is said in the log, and done without. Thread-safe.
class Snapshots {
 public:
  // Most that are kept of a session.
  static constexpr std::size_t kMost = 6;
  // Most entries of the log that restarts repeat so that readers find every frame again.
  static constexpr std::int64_t kMostEntries = 10'000;

  // Called when no restart will need the entries of the log before these any more.
  using Forget = std::function<void(std::int64_t entries)>;

  explicit Snapshots(std::unique_ptr<SnapshotShelf> shelf) : shelf_(std::move(shelf)) {}

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
  // ones are removed: no call was answered with them.
  std::vector<NamedSnapshot> named(const std::string& uid, std::int64_t entries) const;

  void erase(const std::string& uid);

 private:
  void keep_latest(const std::string& uid, const SessionSnapshot& snapshot, std::int64_t oldest,
                   const Forget& forget) const;
  NamedSnapshot keep_named(const std::string& uid, const std::string& id,
                           const SessionSnapshot& snapshot) const;
  std::vector<SnapshotPlace> places(const std::string& uid) const;
  SessionSnapshot read_whole(const std::string& uid, const std::string& name) const;

  const std::unique_ptr<SnapshotShelf> shelf_;
  std::mutex mutex_;
  std::set<std::string> writing_;  // sessions
  Scheduler thread_{1};
};

// Which of a session's snapshots no restart will need, given in ascending order: all but the last
// two, the last two not after frame `oldest`, and some between them.
std::vector<SnapshotPlace> superfluous(std::vector<SnapshotPlace> places, std::int64_t oldest);

}  // namespace weft

#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/model/actions.h"
#include "core/model/textile.h"
#include "server/session/request.h"

// What is kept of a session, so that it can go on in another process: its frames follow from its
// scene and the entries of its log. Snapshots spare the computing of the frames before them.
namespace weft {

struct StepsBegun {
  std::int64_t frames = 0;
};
struct StepsEnded {};  // before their last frame, by their caller
struct RunBegun {
  std::optional<double> time_scale;
  std::optional<std::int64_t> until_frame;
  bool until_rest = false;
};
struct Paused {};
struct TextileSet {
  std::size_t sheet = 0;
  Textile textile;
  double duration = 0;  // s
};
struct Acted {
  std::vector<Action> actions;  // of one hand
};
struct SnapshotKept {
  std::string id;
};
using Event =
    std::variant<StepsBegun, StepsEnded, RunBegun, Paused, TextileSet, Acted, SnapshotKept>;

// Something that was done to a session when `frame` was its newest.
struct LogEntry {
  std::int64_t frame = 0;
  Request request;
  Event event;
};

// How far frames may have been published, and which of them subscribers still need.
struct PublishLimit {
  std::int64_t frame = 0;
  int holders = 0;  // subscribers that the session waits for
  // First frame that subscribers may want again, where there are any: it is there after a restart.
  std::optional<std::int64_t> history_from = {};
  int readers = 0;  // those who may
};

struct SessionSnapshot;

// A snapshot that was asked for.
struct NamedSnapshot {
  std::string id;
  std::int64_t frame = 0;
  std::chrono::system_clock::time_point create_time;
  std::int64_t bytes = 0;
  std::string numerics_id;  // of the server that took it
  std::string damage;       // why it cannot be used; empty: it can
};

// Where the log of one session is written.
class SessionLog {
 public:
  // Called once, from any thread: empty when what was written is safe, else why it is not there.
  using Written = std::function<void(const std::string& error)>;

  virtual ~SessionLog() = default;

  // Adds the entry, if any, and replaces the limit. Writes follow each other in the order of calls.
  virtual void write(const std::optional<LogEntry>& entry, const PublishLimit& limit,
                     const Written& written) = 0;

  // Takes a snapshot, if there is one, to be written in the background. False where it does not. A
  // restart may begin at any frame from `oldest` on, so what lies before the last two snapshots not
  // after it may be forgotten.
  using Take = std::function<std::shared_ptr<const SessionSnapshot>()>;
  virtual bool offer(const Take& take, std::int64_t oldest) = 0;

  // Keeps a snapshot until the session is erased. `kept` is called once, from any thread, with an
  // error as in Written, or with what is kept. It counts once an entry says so.
  using Kept = std::function<void(const std::string& error, const NamedSnapshot& snapshot)>;
  virtual void keep(const std::string& id, std::shared_ptr<const SessionSnapshot> snapshot,
                    const Kept& kept) = 0;
  // Deletes one that no entry refers to.
  virtual void drop(const std::string& id) = 0;
};

// Keeps nothing: the session ends with the process.
class NoLog : public SessionLog {
 public:
  void write(const std::optional<LogEntry>& /*entry*/, const PublishLimit& /*limit*/,
             const Written& written) override {
    written({});
  }
  bool offer(const Take& /*take*/, std::int64_t /*oldest*/) override { return false; }
  void keep(const std::string& /*id*/, std::shared_ptr<const SessionSnapshot> /*snapshot*/,
            const Kept& kept) override {
    kept("nothing is kept of this session", {});
  }
  void drop(const std::string& /*id*/) override {}
};

}  // namespace weft

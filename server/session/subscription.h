#pragma once

#include <cstdint>
#include <memory>

#include "server/session/frame.h"

namespace weft {

class Session;

enum class SessionState { kRestoring, kPaused, kRunning, kFailed };

// What happens when a subscriber falls behind: its subscription expires with the frames that are
// kept, the session waits for it, or it goes on with the newest frame. The last only looks: for it
// alone a session that sleeps does not go on, nor are frames computed again after a restart.
enum class SlowReader { kDisconnect, kHoldSession, kSkip };

// Someone who wants to know when there is something new. `offer` never blocks; it is called from
// any thread with no lock held, and may be called for nothing.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  virtual void offer() = 0;
};

// Who reads frames, and where it is.
struct FrameReader {
  std::weak_ptr<FrameSink> sink;
  std::int64_t next = 0;  // frame
  SlowReader policy = SlowReader::kDisconnect;
  bool wants_stats = false;  // energy and strain
};

// Where a session stands.
struct Progress {
  std::int64_t oldest_frame = 0;
  std::int64_t latest_frame = 0;
  SessionState state = SessionState::kPaused;
  bool at_rest = false;
  double frame_share = 0;  // of the next frame's substeps, once it has taken longer than a slice
  std::uint64_t state_changes = 0;  // so far
};

// What a subscriber finds.
struct Reading {
  enum class Kind {
    kFrame,
    kNothingYet,
    kExpired,  // the next frame is no longer kept
    kFailed,   // there will be no next frame
    kDeleted,
    kEvicted,  // to another server, or the store alone
  };
  Kind kind = Kind::kNothingYet;
  std::shared_ptr<const Frame> frame;  // of kFrame
  std::int64_t skipped = 0;            // frames left out before it
  Progress progress;
};

// A place in the frames of a session. Destroying it ends the subscription, and releases a session
// that waits for it. Thread-safe.
class Subscription {
 public:
  Subscription(std::shared_ptr<Session> session, FrameReader reader);
  ~Subscription();
  Subscription(const Subscription&) = delete;
  Subscription& operator=(const Subscription&) = delete;

  // The next frame, each once and in order, or why there is none; with kSkip the newest. Where no
  // frame is wanted, only whether there will be more.
  Reading read(bool frame_wanted = true);

  std::int64_t next_frame() const;
  Progress progress() const;

 private:
  friend class Session;
  std::shared_ptr<Session> session_;
  FrameReader reader_;  // guarded by the session
};

}  // namespace weft

#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "server/session/session.h"

// Sessions to be tested without gRPC.
namespace weft::testing {

// A sheet of 4 x 5 particles that hangs on two of them.
Scene hung_scene();

// One whose solver diverges after a few frames.
Scene diverging_scene();

// Of all sessions.
Stats& stats();

constexpr std::size_t kMuchHistory = 64 << 20;

// A history for one session.
std::shared_ptr<HistoryBudget> history_for(std::size_t bytes);

std::shared_ptr<Session> make_session(Scheduler& scheduler, const Scene& scene = hung_scene(),
                                      std::size_t history_bytes = kMuchHistory,
                                      const std::string& id = "test");

// Bytes of history that hold so many frames of the hung sheet.
std::size_t history_of(std::size_t frames);

// An outcome that comes later.
class Answer {
 public:
  // Submits the command.
  Answer(Session& session, Command command);
  // Waits for it. Throws where it is not of the kind expected.
  Outcome outcome();
  Applied applied();
  Refusal::Why refused();
  bool is_there() const;

 private:
  struct Shared {
    mutable std::mutex mutex;
    std::condition_variable changed;
    std::optional<Outcome> outcome;
  };
  std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
};

Answer step(Session& session, std::int64_t frames);
Answer run(Session& session, std::optional<std::int64_t> until_frame = {});
Answer pause(Session& session);

// A subscriber that keeps what it reads.
class Watcher : public FrameSink, public std::enable_shared_from_this<Watcher> {
 public:
  static std::shared_ptr<Watcher> of(Session& session, std::optional<std::int64_t> start,
                                     SlowReader policy = SlowReader::kDisconnect,
                                     bool wants_stats = false);
  void offer() override;

  // Waits for the next reading that is not kNothingYet.
  Reading read();
  // Waits until the session's newest frame is this one, or a later one, without reading.
  void wait_for_frame(std::int64_t frame);
  void wait_for_state(SessionState state);
  void leave();

  Subscription& subscription() const { return *subscription_; }

 private:
  void wait_until(const std::function<bool()>& met);

  std::unique_ptr<Subscription> subscription_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t offers_ = 0;
};

}  // namespace weft::testing

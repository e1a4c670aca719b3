#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/simulation.h"
#include "server/session/command.h"
#include "server/session/history.h"
#include "server/session/scheduler.h"
#include "server/session/subscription.h"

namespace weft {

// What a session shows of itself.
struct SessionStatus {
  SessionState state = SessionState::kPaused;
  std::shared_ptr<const Frame> newest;
  std::vector<Textile> textiles;  // of each sheet, now
  std::shared_ptr<const Plan> plan;
  std::string failure;
};

// A simulation that advances on a scheduler. Calls reach it as commands that are carried out
// between two frames; frames leave as shared, constant values. All public methods are thread-safe.
class Session : public Task, public std::enable_shared_from_this<Session> {
 public:
  // Commands that may wait; more are refused (kBusy).
  static constexpr std::size_t kMaxCommands = 256;
  // Answers that are remembered, for those who send a named request again.
  static constexpr std::size_t kMaxAnswers = 1000;

  // PAUSED at frame 0. Precondition: the simulation has no refusal. The scheduler outlives the
  // session; at least two frames are kept, more as long as they fit into `history_bytes`.
  Session(std::string id, Simulation simulation, std::size_t history_bytes, Scheduler& scheduler);

  const std::string& id() const { return id_; }
  const std::string& uid() const { return uid_; }
  std::chrono::system_clock::time_point create_time() const { return create_time_; }

  // As it was created; for textiles see status().
  const Scene& scene() const { return scene_; }
  SessionStatus status() const;

  void submit(Command command);

  // Looks again whether callers have cancelled their steps.
  void wake() { scheduler_.wake(shared_from_this()); }

  // Frames from `start` on, by default from the newest.
  std::unique_ptr<Subscription> subscribe(std::weak_ptr<FrameSink> sink,
                                          std::optional<std::int64_t> start, SlowReader policy);

  // Ends it: refuses every command, waiting and to come, with `why`, and ends subscriptions.
  void close(Refusal::Why why);

  std::optional<Clock::time_point> run_slice() override;

 private:
  friend class Subscription;

  struct Step {
    StepCommand command;
    std::optional<std::int64_t> first;  // frame; absent: not begun
  };
  struct Run {
    std::optional<double> time_scale;
    std::optional<std::int64_t> until_frame;
    bool until_rest = false;
    Clock::time_point start_time;  // of the pace, when the frame was start_frame
    std::int64_t start_frame = 0;
  };

  // on the scheduler's thread
  void execute_commands();
  bool answer_again(Command& command);
  void answer(const Request& request, const Done& done, const Outcome& outcome);
  void execute(StepCommand command);
  void execute(RunCommand command);
  void execute(PauseCommand command);
  void execute(SetTextile command);
  void settle_steps();
  void compute_frame();
  void fail(const std::string& why);
  std::optional<Clock::time_point> next_due();
  std::shared_ptr<const Frame> make_frame() const;

  // with the mutex held
  std::int64_t latest() const { return history_.latest()->number; }
  void set_state(SessionState state);
  bool reached(const Run& run) const;
  std::int64_t first_held_frame() const;
  Progress progress() const;
  Refusal refuse(Refusal::Why why) const { return {why, latest(), {}, {}}; }
  Applied applied(std::int64_t frame) const;
  std::optional<Outcome> settle(Step& step) const;

  // of subscriptions
  Reading read(Subscription& subscription);
  void unsubscribe(const Subscription& subscription);
  bool release();  // with the mutex held
  void offer_to_all();

  const std::string id_;
  const std::string uid_;
  const std::chrono::system_clock::time_point create_time_ = std::chrono::system_clock::now();
  Scheduler& scheduler_;
  Simulation simulation_;                  // touched by the slice only
  Answers<Outcome> answers_{kMaxAnswers};  // touched by the slice only
  const Scene scene_;

  mutable std::mutex mutex_;  // guards all below
  std::deque<Command> commands_;
  std::deque<Step> steps_;
  std::optional<Run> run_;
  std::optional<Refusal::Why> closed_;
  SessionState state_ = SessionState::kPaused;
  std::uint64_t state_changes_ = 0;
  std::string failure_;
  std::vector<Textile> textiles_;
  std::shared_ptr<const Plan> plan_;
  History history_;
  std::vector<Subscription*> subscriptions_;
  bool held_ = false;  // idle until a subscriber reads on
};

}  // namespace weft

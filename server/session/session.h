#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/simulation.h"
#include "server/session/audience.h"
#include "server/session/command.h"
#include "server/session/command_queue.h"
#include "server/session/journal.h"
#include "server/session/run.h"
#include "server/session/scheduler.h"
#include "server/session/snapshot.h"
#include "server/session/stats.h"
#include "server/session/subscription.h"
#include "server/session/timeline.h"

namespace weft {

// Names of a session, and when it was created.
struct SessionIdentity {
  std::string id;
  std::string uid;          // another session of the same id has another one
  std::string numerics_id;  // of the server that created it
  std::chrono::system_clock::time_point create_time;
  std::string owner;  // principal; empty: nobody's, made where there were none
  // Particles times substeps that a frame of it may take; 0: made where there was no such limit.
  std::int64_t max_frame_work = 0;
};

// A new session's, with a uid of 128 random bits.
SessionIdentity make_identity(std::string id, std::string numerics_id, std::string owner = {},
                              std::int64_t max_frame_work = 0);

// Of each sheet.
std::vector<Textile> textiles_of(const Scene& scene);

// What a session shows of itself.
struct SessionStatus {
  SessionState state = SessionState::kPaused;
  std::shared_ptr<const Frame> newest;
  std::vector<Textile> textiles;  // of each sheet, now
  std::shared_ptr<const Plan> plan;
  std::vector<Repair> repairs;  // all so far
  std::string failure;
  std::chrono::duration<double> lateness{};  // of the newest frame, where it runs at a pace
};

// What an earlier process left of a session.
struct SavedSession {
  std::vector<LogEntry> log;
  PublishLimit limit;
  // At most at limit.history_from, or as early as there is one.
  std::optional<SessionSnapshot> snapshot = {};
  std::int64_t first = 0;                 // entries that were forgotten before those of `log`
  std::vector<NamedSnapshot> named = {};  // in order of frame

  // There were so far.
  std::int64_t entries() const { return first + static_cast<std::int64_t>(log.size()); }
};

// Receives what an operator should know: repairs and failures, a line each. Called from any thread,
// with no lock held. Must not block.
using Notify = std::function<void(const std::string& line)>;

// Where sessions live. The scheduler and the stats outlive them.
struct SessionHost {
  Scheduler& scheduler;
  Stats& stats;
  std::shared_ptr<HistoryBudget> history;
  Notify notify = {};
  // Computing between two snapshots; a session of more than 20 000 particles has them more rarely.
  std::chrono::duration<double> snapshot_after{2};
  std::size_t max_snapshots = 16;  // on demand
  // The publish limit is not written more often, and the session goes on for about as long without
  // an answer.
  static constexpr std::chrono::duration<double> kLimitInterval{0.5};
  std::chrono::duration<double> limit_interval = kLimitInterval;
  // Frames that all subscribers had taken longer ago are not there any more after a restart.
  std::chrono::duration<double> return_time{60};
};

// A simulation that advances on a scheduler. Calls reach it as commands that are carried out
// between two frames, each when it is safe in the log; frames leave as shared, constant values. All
// public methods are thread-safe.
class Session : public Task, public std::enable_shared_from_this<Session> {
 public:
  // Answers that are remembered, for those who send a named request again.
  static constexpr std::size_t kMaxAnswers = 1000;
  // How long a session that sleeps without a goal and a stream goes on after somebody looked.
  static constexpr std::chrono::seconds kAwakeTime{2};
  // How long one with nothing to do holds what the next frame needs and can be made again: longer
  // than those who step it frame by frame take between two.
  static constexpr std::chrono::seconds kUnpackedTime{1};
  // How long a session that was restored waits for subscribers that it had held frames for, and may
  // be restored again with the frames that subscribers had.
  static constexpr std::chrono::seconds kHoldAfterRestore{30};

  // PAUSED at frame 0. Precondition: the simulation has no refusal.
  Session(SessionIdentity identity, Simulation simulation, const SessionHost& host,
          std::unique_ptr<SessionLog> log);

  // Computes again what there was since the snapshot, or since frame 0, before any command is
  // carried out, then goes on as it was. False, and nothing done, where the log does not reach back
  // that far. Called at most once, first.
  [[nodiscard]] bool restore(SavedSession saved);

  const SessionIdentity& identity() const { return identity_; }
  const std::string& id() const { return identity_.id; }
  const std::string& uid() const { return identity_.uid; }
  const std::string& numerics_id() const { return identity_.numerics_id; }
  const std::string& owner() const { return identity_.owner; }
  std::int64_t particle_count() const { return particle_count_; }
  std::chrono::system_clock::time_point create_time() const { return identity_.create_time; }

  // As it was created; for textiles see status(). Actions do not show.
  const Scene& scene() const { return scene_; }
  SessionStatus status() const;
  // Those that were asked for, in order of frame.
  std::vector<NamedSnapshot> snapshots() const;

  void submit(Command command);

  // Somebody looks: one that sleeps goes on for kAwakeTime, also without a goal and a stream.
  void keep_awake();

  // One for a stream to act with. What is in it when a session is restored is let go.
  int new_hand() { return ++hands_; }

  // Looks again whether callers have cancelled their steps.
  void wake() { scheduler_.wake(shared_from_this()); }

  // Frames from `start` on, by default from the newest.
  std::unique_ptr<Subscription> subscribe(std::weak_ptr<FrameSink> sink,
                                          std::optional<std::int64_t> start, SlowReader policy,
                                          bool wants_stats);

  // Drops frames that do not fit into its share of the history any more.
  void trim_history();

  // Ends it as one that is with no server now, where it is paused and was not used for so long;
  // false where it is not so.
  [[nodiscard]] bool evict(std::chrono::duration<double> unused);

  // Ends it: refuses every command, waiting and to come, with `why`, and ends subscriptions.
  void close(Refusal::Why why);

  std::optional<Clock::time_point> run_slice() override;

 private:
  friend class Subscription;

  // What an earlier process left to be computed again.
  struct Restoring {
    std::deque<LogEntry> log;
    std::int64_t frame = 0;  // as far as frames may have been published
  };

  // A slice: what is done between two frames, then a frame or a part of one. session.cpp
  bool settle();
  bool settle_writing();
  bool settle_steps();
  bool go_on_with_frame();
  bool frame_unwanted() const;
  bool stats_wanted() const;
  void compute_frame(Clock::time_point due);
  void end_frame(FramePart part, Clock::time_point due);
  std::vector<Repair> publish_repairs();
  void write_limit();
  void fail(const std::string& why);
  std::optional<Clock::time_point> next_due();
  std::optional<Clock::time_point> due_time();
  std::optional<Clock::time_point> idle_since() const;
  void offer_to_all();

  // Commands: checked, written, carried out, answered. session_commands.cpp
  bool execute_command();
  bool answer_again(Command& command);
  void answer(const Request& request, const Done& done, const Outcome& outcome);
  void execute(StepCommand command);
  void execute(RunCommand command);
  void execute(PauseCommand command);
  void execute(SetTextile command);
  void execute(Act command);
  void execute(KeepSnapshot command);
  void execute(Judge command);
  std::optional<Refusal> refusal_of(const KeepSnapshot& command) const;
  void enter(const KeepSnapshot& command, const NamedSnapshot& made, const std::string& error);
  void begin_step();
  void end_step();
  void write(const Request& request, const Event& event,
             std::function<void(const std::string&)> then);
  void carry_out(const Request& request, const Done& done, const Event& event);
  Outcome apply(const Event& event);  // but steps
  Outcome apply(const RunBegun& run);
  Outcome apply(const TextileSet& change);
  Outcome apply(const Acted& acted);
  Outcome pause();

  // Snapshots, and what they and the log are for. session_recovery.cpp
  bool settle_restoring();
  void apply_again(const LogEntry& entry);
  void let_go_of_streams();
  bool begin_at(const SavedSession& saved);
  void offer_snapshot();
  std::shared_ptr<const SessionSnapshot> snapshot() const;

  // with the mutex held
  std::int64_t latest() const { return audience_.latest(); }
  void set_state(SessionState state);
  bool active() const { return run_ || queue_.step_begun() || restoring_; }
  bool unattended() const;
  std::int64_t goal() const;
  std::int64_t limit_after(const Event& event) const;
  bool release();
  Progress progress() const;
  Refusal refuse(Refusal::Why why, std::vector<Problem> problems = {}) const {
    return {why, latest(), std::move(problems), {}, {}};
  }
  std::optional<Refusal> refusal_of_change() const;
  Applied applied(std::int64_t frame) const;
  std::optional<Outcome> outcome_of(const CommandQueue::Step& step) const;

  // of subscriptions
  Reading read(FrameReader& reader, bool frame_wanted);
  void unsubscribe(const FrameReader& reader);

  const SessionIdentity identity_;
  Scheduler& scheduler_;
  Stats& stats_;
  const std::unique_ptr<SessionLog> log_;
  const Notify notify_;
  const std::size_t max_snapshots_;

  // One thread at a time runs a slice (Task); what only slices touch needs no lock.
  Timeline timeline_;
  Answers<Outcome> answers_{kMaxAnswers};

  const Scene scene_;
  const std::int64_t particle_count_;
  std::atomic<int> hands_ = 0;

  // Guards all below. Held for moments: nothing is computed, written or called back under it.
  mutable std::mutex mutex_;
  CommandQueue queue_;
  Journal journal_;
  Audience audience_;
  std::optional<ActiveRun> run_;
  std::optional<Restoring> restoring_;
  std::optional<Refusal::Why> closed_;
  SessionState state_ = SessionState::kPaused;
  std::uint64_t state_changes_ = 0;
  std::string failure_;
  std::vector<Textile> textiles_;
  std::shared_ptr<const Plan> plan_;
  std::vector<Repair> repairs_;
  std::chrono::duration<double> lateness_{};
  double frame_share_ = 0;  // of the frame under way
  bool held_ = false;       // idle until somebody comes, or a subscriber reads on
  Clock::time_point looked_at_;
  Clock::time_point used_ = Clock::now();  // a call, a frame, the end of a stream
};

}  // namespace weft

#include "server/session/session.h"

#include <algorithm>
#include <cassert>
#include <iomanip>
#include <iterator>
#include <limits>
#include <new>
#include <random>
#include <set>
#include <sstream>

#include "server/session/idle_threads.h"

namespace weft {
namespace {

// 128 random bits in hexadecimal.
std::string make_uid() {
  std::random_device random;
  std::string uid;
  for (int i = 0; i < 32; ++i) uid += "0123456789abcdef"[random() % 16];
  return uid;
}

// Whether the command has no caller who could send it again.
bool must_be_taken(const Command& command) {
  const auto* act = std::get_if<Act>(&command);
  return act != nullptr && !act->actions.empty() &&
         act->actions.front().kind == Action::Kind::kLetGo;
}

std::int64_t count_particles(const Scene& scene) {
  std::int64_t particles = 0;
  for (const auto& sheet : scene.sheets) particles += sheet.particle_count();
  return particles;
}

}  // namespace

std::vector<Textile> textiles_of(const Scene& scene) {
  std::vector<Textile> textiles;
  for (const auto& sheet : scene.sheets) textiles.push_back(sheet.textile);
  return textiles;
}

SessionIdentity make_identity(std::string id, std::string numerics_id, std::string owner,
                              std::int64_t max_frame_work) {
  return {std::move(id),    make_uid(),    std::move(numerics_id), std::chrono::system_clock::now(),
          std::move(owner), max_frame_work};
}

Session::Session(SessionIdentity identity, Simulation simulation, const SessionHost& host,
                 std::unique_ptr<SessionLog> log)
    : identity_(std::move(identity)),
      scheduler_(host.scheduler),
      stats_(host.stats),
      log_(std::move(log)),
      notify_(host.notify),
      simulation_(std::move(simulation)),
      scene_(simulation_.scene()),
      particle_count_(count_particles(scene_)),
      snapshot_after_(host.snapshot_after),
      max_snapshots_(host.max_snapshots),
      reach_interval_(host.reach_time),
      return_time_(host.return_time),
      textiles_(textiles_of(scene_)),
      plan_(std::make_shared<const Plan>(simulation_.plan())),
      history_(host.history_bytes) {
  if (identity_.max_frame_work > 0) simulation_.limit_frame_work(identity_.max_frame_work);
  history_.push(make_frame({}), 0);
}

bool Session::restore(SessionPast past) {
  const bool begun = past.snapshot && begin_at(*past.snapshot, past);
  if (!begun && past.first > 0) return false;
  bool repeats = false;
  {
    std::lock_guard lock(mutex_);
    reach_ = past.reach;
    named_ = std::move(past.named);
    if (!begun && past.log.empty()) return true;
    const auto next = past.log.begin() + entries_ - past.first;
    repeats = next != past.log.end() || run_ || !steps_.empty();
    if (repeats) {
      set_state(SessionState::kRestoring);
      restoring_ =
          Restoring{{std::make_move_iterator(next), std::make_move_iterator(past.log.end())},
                    past.reach.frame};
    }
    if (past.reach.history_from) {
      readers_until_ = Clock::now() + kHoldAfterRestore;
      taken_.push_back({Clock::now(), *past.reach.history_from});
      past_readers_ = past.reach.readers;
      if (past.reach.holders > 0) {
        past_holders_ = PastHolders{past.reach.holders, *past.reach.history_from, readers_until_};
      }
    }
  }
  if (!repeats) let_go_of_streams();
  wake();
  return true;
}

SessionStatus Session::status() const {
  std::lock_guard lock(mutex_);
  return {state_, history_.latest(), textiles_, plan_, repairs_, failure_, lateness_};
}

void Session::keep_awake() {
  {
    std::lock_guard lock(mutex_);
    looked_at_ = used_ = Clock::now();
    if (!release()) return;
  }
  wake();
}

void Session::submit(Command command) {
  std::optional<Refusal> refusal;
  {
    std::lock_guard lock(mutex_);
    used_ = Clock::now();
    if (closed_) {
      refusal = refuse(*closed_);
    } else if (commands_.size() + steps_.size() >= kMaxCommands && !must_be_taken(command)) {
      refusal = refuse(Refusal::Why::kBusy);
    } else {
      commands_.push_back(std::move(command));
    }
  }
  if (refusal) {
    std::visit([&](const auto& refused) { refused.done(*refusal); }, command);
  } else {
    wake();
  }
}

bool Session::evict(std::chrono::duration<double> unused) {
  std::lock_guard lock(mutex_);
  const bool busy = closed_ || state_ != SessionState::kPaused || !commands_.empty() ||
                    !steps_.empty() || !subscriptions_.empty() || past_holders_ || writing_.then ||
                    writing_.reach;
  if (busy || Clock::now() - used_ < unused) return false;
  closed_ = Refusal::Why::kTaken;
  return true;
}

void Session::close(Refusal::Why why) {
  std::deque<Command> commands;
  std::deque<Step> steps;
  Refusal refusal;
  {
    std::lock_guard lock(mutex_);
    if (closed_) return;
    closed_ = why;
    refusal = refuse(why);
    commands.swap(commands_);
    steps.swap(steps_);
    run_.reset();
  }
  for (const auto& step : steps) step.command.done(refusal);
  for (const auto& command : commands) {
    std::visit([&](const auto& refused) { refused.done(refusal); }, command);
  }
  offer_to_all();
}

std::optional<Clock::time_point> Session::run_slice() {
  try {
    if (!go_on_with_frame() && !settle()) return std::nullopt;
    write_reach();
    const auto due = next_due();
    if (!due || *due > Clock::now()) return due;
    compute_frame(*due);
    if (!go_on_with_frame() && !settle()) return std::nullopt;
    write_reach();
  } catch (const std::bad_alloc&) {
    fail("the server ran out of memory");
  }
  return next_due();
}

// Whether a frame is unfinished, which nothing is done before but to drop it.
bool Session::go_on_with_frame() {
  if (simulation_.frame_share() == 0) return false;
  if (!frame_unwanted() || !simulation_.drop_frame()) return true;
  frame_work_ = {};
  std::lock_guard lock(mutex_);
  frame_share_ = 0;
  return false;
}

// Whether the frame under way is not to be waited for.
bool Session::frame_unwanted() const {
  std::lock_guard lock(mutex_);
  if (restoring_) return false;
  const auto pauses = [](const Command& command) {
    return std::holds_alternative<PauseCommand>(command);
  };
  return std::any_of(commands_.begin(), commands_.end(), pauses) ||
         (steps_begun() && steps_.front().command.cancelled.stop_requested());
}

// Does what is to be done between two frames; false while it waits for the log.
bool Session::settle() {
  for (;;) {
    if (!settle_writing()) return false;
    if (!settle_restoring()) return true;
    if (execute_command()) continue;
    if (settle_steps()) return true;
  }
}

bool Session::settle_writing() {
  for (;;) {
    std::function<void(const std::string&)> then;
    std::string error;
    {
      std::lock_guard lock(mutex_);
      if (!writing_.then) return true;
      if (!writing_.written) return false;
      then = std::exchange(writing_.then, nullptr);
      error = *std::exchange(writing_.written, std::nullopt);
    }
    then(error);  // which may write again
    if (log_grew()) offer_snapshot();
  }
}

// Repeats what was done at this frame; false where there is more, after the next frame.
bool Session::settle_restoring() {
  for (;;) {
    LogEntry entry;
    {
      std::lock_guard lock(mutex_);
      if (!restoring_) return true;
    }
    settle_steps();
    {
      std::lock_guard lock(mutex_);
      auto& log = restoring_->log;
      if (log.empty()) {
        if ((run_ || steps_begun()) && latest() < restoring_->frame) return false;
        break;
      }
      if (log.front().frame > latest()) return false;
      entry = std::move(log.front());
      log.pop_front();
    }
    apply_again(entry);
  }
  let_go_of_streams();
  {
    std::lock_guard lock(mutex_);
    restoring_.reset();
    set_state(run_ ? SessionState::kRunning : SessionState::kPaused);
    if (run_) {
      run_->start_time = Clock::now();
      run_->start_frame = latest();
    }
  }
  offer_to_all();
  return true;
}

// The streams of the past are gone.
void Session::let_go_of_streams() {
  std::set<int> hands;
  for (const Grip& grip : simulation_.constraints().grips) hands.insert(grip.hand);
  hands.erase(0);
  std::lock_guard lock(mutex_);
  for (const int hand : hands) {
    const Action action{.kind = Action::Kind::kLetGo, .hand = hand};
    commands_.push_front(Act{{action}, {}, [](const Outcome&) {}});
  }
}

void Session::apply_again(const LogEntry& entry) {
  ++entries_;
  const Done nobody = [](const Outcome&) {};
  if (const auto* begun = std::get_if<StepsBegun>(&entry.event)) {
    StepCommand command;
    command.frames = begun->frames;
    command.request = entry.request;
    command.done = nobody;
    std::lock_guard lock(mutex_);
    steps_.push_back({std::move(command), latest() + 1});
  } else if (std::holds_alternative<StepsEnded>(entry.event)) {
    std::lock_guard lock(mutex_);
    if (!steps_.empty()) steps_.pop_front();
  } else {
    answer(entry.request, nobody, apply(entry.event));
  }
}

void Session::fail(const std::string& why) {
  {
    std::lock_guard lock(mutex_);
    failure_ = why + "; frame " + std::to_string(latest()) + " is the last";
    run_.reset();
    restoring_.reset();
    set_state(SessionState::kFailed);
  }
  ++stats_.failures;
  if (notify_) notify_("session " + identity_.id + " failed: " + failure_);
  offer_to_all();
}

// False where none waits.
bool Session::execute_command() {
  std::optional<Command> command;
  {
    std::lock_guard lock(mutex_);
    if (commands_.empty()) return false;
    command = std::move(commands_.front());
    commands_.pop_front();
  }
  if (!answer_again(*command)) {
    std::visit([&](auto& next) { execute(std::move(next)); }, *command);
  }
  return true;
}

// Whether the command is one that was sent before; it gets the answer of the first.
bool Session::answer_again(Command& command) {
  const Request& request =
      std::visit([](auto& each) -> const Request& { return each.request; }, command);
  if (request.id.empty()) return false;
  Done& done = std::visit([](auto& each) -> Done& { return each.done; }, command);
  std::optional<Outcome> outcome;
  {
    std::lock_guard lock(mutex_);
    if (const auto* known = answers_.find(request)) {
      const bool same = known->checksum == request.checksum;
      outcome = same ? known->answer : refuse(Refusal::Why::kRequestUsed);
    }
    for (auto& step : steps_) {
      if (outcome || step.command.request.id != request.id) continue;
      if (step.command.request.checksum != request.checksum) {
        outcome = refuse(Refusal::Why::kRequestUsed);
      } else {
        step.command.done = [first = std::move(step.command.done),
                             again = std::move(done)](const Outcome& both) {
          first(both);
          again(both);
        };
        return true;
      }
    }
  }
  if (!outcome) return false;
  done(*outcome);
  return true;
}

// What changed something is remembered; what was refused may be tried again.
void Session::answer(const Request& request, const Done& done, const Outcome& outcome) {
  const auto* refusal = std::get_if<Refusal>(&outcome);
  if (refusal == nullptr || refusal->why == Refusal::Why::kInterrupted) {
    answers_.remember(request, outcome);
  }
  done(outcome);
}

// Writes what is done at this frame to the log; the session stands still until then.
void Session::write(const Request& request, const Event& event,
                    std::function<void(const std::string&)> then) {
  LogEntry entry{0, request, event};
  Reach reach;
  {
    std::lock_guard lock(mutex_);
    entry.frame = latest();
    reach = reach_to(reach_after(entry.event));
    writing_.then = [this, then = std::move(then)](const std::string& error) {
      if (error.empty()) ++entries_;
      then(error);
    };
    writing_.written.reset();
  }
  log_->write(entry, reach, [self = shared_from_this(), reach](const std::string& error) {
    {
      std::lock_guard lock(self->mutex_);
      if (error.empty()) self->reach_ = reach;
      self->writing_.written = error;
    }
    self->wake();
  });
}

// Does something when it is in the log, and answers.
void Session::carry_out(const Request& request, const Done& done, const Event& event) {
  write(request, event, [this, request, done, event](const std::string& error) {
    std::optional<Refusal> refusal;
    {
      std::lock_guard lock(mutex_);
      refusal = refusal_of_change();
      if (!refusal && !error.empty()) {
        refusal = refuse(Refusal::Why::kNotKept);
        refusal->text = error;
      }
    }
    answer(request, done, refusal ? Outcome(*refusal) : apply(event));
  });
}

void Session::execute(StepCommand command) {
  std::optional<Refusal> refusal;
  {
    std::lock_guard lock(mutex_);
    if (!closed_) {
      steps_.push_back({std::move(command), std::nullopt});
      return;
    }
    refusal = refuse(*closed_);
  }
  command.done(*refusal);
}

void Session::execute(RunCommand command) {
  std::optional<Refusal> refusal;
  {
    std::lock_guard lock(mutex_);
    refusal = refusal_of_change();
    if (!refusal && command.until_frame && *command.until_frame <= latest()) {
      refusal = refuse(Refusal::Why::kNotAhead);
    }
  }
  if (refusal) return command.done(*refusal);
  carry_out(command.request, command.done,
            RunBegun{command.time_scale, command.until_frame, command.until_rest});
}

void Session::execute(PauseCommand command) {
  std::optional<Refusal> refusal;
  {
    std::lock_guard lock(mutex_);
    refusal = refusal_of_change();
  }
  if (refusal) return command.done(*refusal);
  carry_out(command.request, command.done, Paused{});
}

void Session::execute(SetTextile command) {
  std::optional<Refusal> refusal;
  {
    std::lock_guard lock(mutex_);
    refusal = refusal_of_change();
  }
  if (refusal) return command.done(*refusal);
  const auto edited = command.edit(simulation_.target_textile(command.sheet));
  if (const auto* problems = std::get_if<std::vector<Problem>>(&edited)) {
    std::unique_lock lock(mutex_);
    refusal = refuse(Refusal::Why::kInvalid, *problems);
    lock.unlock();
    return command.done(*refusal);
  }
  carry_out(command.request, command.done,
            TextileSet{command.sheet, std::get<Textile>(edited), command.duration});
}

void Session::execute(Act command) {
  auto problems = simulation_.problems_of(command.actions);
  std::optional<Refusal> refusal;
  {
    std::lock_guard lock(mutex_);
    refusal = refusal_of_change();
    if (!refusal && !problems.empty()) {
      refusal = refuse(Refusal::Why::kInvalid, std::move(problems));
    }
  }
  if (refusal) return command.done(*refusal);
  carry_out(command.request, command.done, Acted{command.actions});
}

Outcome Session::apply(const Event& event) {
  if (const auto* run = std::get_if<RunBegun>(&event)) return apply(*run);
  if (const auto* change = std::get_if<TextileSet>(&event)) return apply(*change);
  if (const auto* acted = std::get_if<Acted>(&event)) return apply(*acted);
  if (std::holds_alternative<SnapshotKept>(event)) {
    std::lock_guard lock(mutex_);
    return applied(latest());
  }
  assert(std::holds_alternative<Paused>(event));
  return pause();
}

Outcome Session::apply(const RunBegun& run) {
  Outcome outcome;
  {
    std::lock_guard lock(mutex_);
    run_ = Run{run.time_scale, run.until_frame, run.until_rest, Clock::now(), latest()};
    set_state(SessionState::kRunning);
    outcome = applied(latest() + 1);
  }
  offer_to_all();
  return outcome;
}

Outcome Session::pause() {
  std::deque<Step> steps;
  Outcome outcome;
  Refusal interrupted;
  {
    std::lock_guard lock(mutex_);
    interrupted = refuse(Refusal::Why::kInterrupted);
    steps.swap(steps_);
    run_.reset();
    set_state(SessionState::kPaused);
    outcome = applied(latest() + 1);
  }
  offer_to_all();
  for (const auto& step : steps) {
    // one that had begun is not begun again
    answer(step.first ? step.command.request : Request{}, step.command.done, interrupted);
  }
  return outcome;
}

// Refused or not, the log repeats it: what it depends on is the same then.
Outcome Session::apply(const TextileSet& change) {
  const auto step = simulation_.set_textile(change.sheet, change.textile, change.duration);
  std::lock_guard lock(mutex_);
  if (step) return Refusal{Refusal::Why::kUnstable, latest(), {}, *step, "textile"};
  textiles_ = textiles_of(simulation_.scene());
  plan_ = std::make_shared<const Plan>(simulation_.plan());
  Applied done = applied(latest() + 1);
  done.textile = change.textile;
  return done;
}

Outcome Session::apply(const Acted& acted) {
  const auto step = simulation_.act(acted.actions);
  std::lock_guard lock(mutex_);
  if (step) return Refusal{Refusal::Why::kUnstable, latest(), {}, *step, "actions"};
  plan_ = std::make_shared<const Plan>(simulation_.plan());
  return applied(latest() + 1);
}

// Answers steps that are over, and begins the next one; false when the log is to be written for it.
bool Session::settle_steps() {
  std::vector<std::pair<StepCommand, Outcome>> settled;
  bool begin = false, end = false;
  {
    std::lock_guard lock(mutex_);
    std::erase_if(steps_, [&](Step& step) {
      if (step.first || !step.command.cancelled.stop_requested()) return false;
      settled.emplace_back(std::move(step.command), refuse(Refusal::Why::kCancelled));
      return true;
    });
    while (!steps_.empty()) {
      const Step& step = steps_.front();
      if (auto outcome = settle(step)) {
        settled.emplace_back(std::move(steps_.front().command), std::move(*outcome));
        steps_.pop_front();
        continue;
      }
      begin = !step.first;
      end = step.first && step.command.cancelled.stop_requested();
      break;
    }
  }
  for (const auto& [command, outcome] : settled) answer(command.request, command.done, outcome);
  if (begin) begin_step();
  if (end) end_step();
  return !begin && !end;
}

// The answer to the first step; absent while it is under way, or to be begun.
std::optional<Outcome> Session::settle(const Step& step) const {
  const auto& command = step.command;
  if (state_ == SessionState::kFailed) return refuse(Refusal::Why::kFailed);
  if (!step.first) {
    if (state_ == SessionState::kRunning) return refuse(Refusal::Why::kRunning);
    if (command.expected_frame && *command.expected_frame != latest()) {
      return refuse(Refusal::Why::kStale);
    }
    return std::nullopt;
  }
  if (latest() - *step.first + 1 < command.frames) return std::nullopt;
  return applied(*step.first);
}

void Session::begin_step() {
  Request request;
  StepsBegun event;
  {
    std::lock_guard lock(mutex_);
    if (steps_.empty()) return;  // closed meanwhile
    request = steps_.front().command.request;
    event.frames = steps_.front().command.frames;
  }
  write(request, event, [this](const std::string& error) {
    StepCommand command;
    Refusal refusal;
    {
      std::lock_guard lock(mutex_);
      if (steps_.empty()) return;  // closed meanwhile
      if (error.empty()) {
        steps_.front().first = latest() + 1;
        return;
      }
      refusal = refuse(Refusal::Why::kNotKept);
      refusal.text = error;
      command = std::move(steps_.front().command);
      steps_.pop_front();
    }
    command.done(refusal);
  });
}

// Ends the step whose caller went away.
void Session::end_step() {
  write({}, StepsEnded{}, [this](const std::string& /*error*/) {
    StepCommand command;
    Refusal refusal;
    {
      std::lock_guard lock(mutex_);
      if (steps_.empty()) return;  // closed meanwhile
      refusal = refuse(Refusal::Why::kCancelled);
      command = std::move(steps_.front().command);
      steps_.pop_front();
    }
    command.done(refusal);
  });
}

void Session::compute_frame(Clock::time_point due) {
  const auto begin = Clock::now();
  const FramePart part = advance_frame();
  const std::chrono::duration<double> time = Clock::now() - begin;
  work_ += time;
  frame_work_ += time;
  {
    std::lock_guard lock(mutex_);
    frame_share_ = part == FramePart::kUnfinished ? simulation_.frame_share() : 0;
  }
  if (part != FramePart::kUnfinished) end_frame(part, due);
}

void Session::end_frame(FramePart part, Clock::time_point due) {
  auto repairs = take_repairs();
  if (part == FramePart::kFailed) return fail("the solver diverged: " + simulation_.failure());
  count_frame(std::exchange(frame_work_, {}));
  const auto frame = make_frame(std::move(repairs));
  {
    std::lock_guard lock(mutex_);
    if (closed_) return;
    const auto end = used_ = Clock::now();
    history_.push(frame, first_held_frame());
    if (simulation_.textile_changed()) {
      textiles_ = textiles_of(simulation_.scene());
      plan_ = std::make_shared<const Plan>(simulation_.plan());
    }
    lateness_ = {};
    if (due != Clock::time_point::min()) {
      lateness_ = end - due;
      stats_.lateness.add(lateness_);
    }
    if (run_ && reached(*run_)) {
      run_.reset();
      set_state(SessionState::kPaused);
    }
  }
  offer_to_all();
  if (snapshot_due() || log_grew()) offer_snapshot();
}

void Session::count_frame(std::chrono::duration<double> time) {
  ++stats_.frames;
  if (simulation_.substeps() == 0) {
    ++stats_.sleeping_frames;
    return;
  }
  stats_.substeps += simulation_.substeps();
  stats_.particle_substeps += simulation_.substeps() * simulation_.particle_count();
  stats_.frame_time.add(time);
}

// A slice of it, which is shorter where something else waits for a thread.
FramePart Session::advance_frame() {
  constexpr std::chrono::microseconds kSlice{20'000}, kBusySlice{200};
  const auto begin = Clock::now();
  const Enough enough = [&] {
    const auto time = Clock::now() - begin;
    return time >= kSlice || (time >= kBusySlice && scheduler_.busy());
  };
  const int most_threads = simulation_.most_threads();
  if (most_threads == 1) return simulation_.advance_frame(enough);
  IdleThreads pool(scheduler_, most_threads);
  return simulation_.advance_frame(enough, pool);
}

// Those that the last frame took, which are published with it.
std::vector<Repair> Session::take_repairs() {
  const std::vector<Repair>& all = simulation_.repairs();
  std::vector<Repair> taken;
  {
    std::lock_guard lock(mutex_);
    taken.assign(all.begin() + static_cast<std::ptrdiff_t>(repairs_.size()), all.end());
    if (taken.empty()) return taken;
    stats_.repairs += static_cast<std::int64_t>(taken.size());
    repairs_ = all;
    plan_ = std::make_shared<const Plan>(simulation_.plan());
  }
  if (!notify_) return taken;
  for (const Repair& repair : taken) {
    std::ostringstream us;
    us << std::setprecision(4) << repair.substep * 1e6;
    notify_("session " + identity_.id + ": frame " + std::to_string(repair.frame) +
            " is computed again, " + us.str() + " us a substep: " + repair.reason);
  }
  return taken;
}

// When the next frame is to be computed; nullopt: not before something happens.
std::optional<Clock::time_point> Session::next_due() {
  const auto due = due_time();
  if (!due && idle()) simulation_.release_memory();
  return due;
}

// Whether there is nothing to compute: nothing was asked for, or there is nobody to see it.
bool Session::idle() {
  std::lock_guard lock(mutex_);
  return !active() || (!restoring_ && unattended());
}

std::optional<Clock::time_point> Session::due_time() {
  std::lock_guard lock(mutex_);
  if (closed_ || writing_.then || !active()) return std::nullopt;
  if (must_hold()) {
    held_ = true;
    return past_holders_ ? std::optional(past_holders_->until) : std::nullopt;
  }
  if (restoring_) return Clock::time_point::min();
  if (unattended()) {
    held_ = true;
    return std::nullopt;
  }
  release();
  if (latest() >= reach_.frame || !reach_suffices()) return std::nullopt;  // being written
  if (steps_begun() || !run_->time_scale) return Clock::time_point::min();
  const double frames = static_cast<double>(latest() + 1 - run_->start_frame);
  const std::chrono::duration<double> since_start =
      std::chrono::duration<double>(frames * scene_.solver.frame_step / *run_->time_scale);
  return run_->start_time + std::chrono::duration_cast<Clock::duration>(since_start);
}

std::shared_ptr<const Frame> Session::make_frame(std::vector<Repair> repairs) const {
  auto frame = std::make_shared<Frame>();
  const std::size_t values = 3 * static_cast<std::size_t>(simulation_.particle_count());
  frame->number = simulation_.frame();
  frame->time = simulation_.time();
  frame->positions.resize(values);
  frame->velocities.resize(values);
  simulation_.copy_positions(frame->positions);
  simulation_.copy_velocities(frame->velocities);
  frame->stats = simulation_.stats();
  frame->at_rest = simulation_.at_rest();
  frame->substeps = simulation_.substeps();
  frame->substep = simulation_.plan().step.substep;
  frame->repairs = std::move(repairs);
  return frame;
}

// Whether the frames to come are all like the last one, without a goal and with nobody to see them.
bool Session::unattended() const {
  return simulation_.asleep() && recorders() == 0 && !steps_begun() && !run_->until_frame &&
         Clock::now() > looked_at_ + kAwakeTime;
}

// While it is restored it shows nothing else, but a failure.
void Session::set_state(SessionState state) {
  if (restoring_ && state != SessionState::kFailed) return;
  if (state != state_) ++state_changes_;
  state_ = state;
}

bool Session::reached(const Run& run) const {
  return (run.until_frame && latest() >= *run.until_frame) ||
         (run.until_rest && history_.latest()->at_rest);
}

// Last frame that is to be computed as things are.
std::int64_t Session::goal() const {
  constexpr auto kNever = std::numeric_limits<std::int64_t>::max();
  std::int64_t goal = latest();
  if (run_) goal = std::max(goal, run_->until_frame.value_or(kNever));
  if (steps_begun()) {
    goal = std::max(goal, *steps_.front().first + steps_.front().command.frames - 1);
  }
  return goal;
}

// What keeps a session from being changed.
std::optional<Refusal> Session::refusal_of_change() const {
  if (closed_) return refuse(*closed_);
  if (state_ == SessionState::kFailed) return refuse(Refusal::Why::kFailed);
  return std::nullopt;
}

Applied Session::applied(std::int64_t frame) const {
  const Frame& newest = *history_.latest();
  return {frame, newest.number, newest.time, newest.at_rest, {}, plan_};
}

Progress Session::progress() const {
  return {history_.oldest(),          latest(),     state_,
          history_.latest()->at_rest, frame_share_, state_changes_};
}

}  // namespace weft

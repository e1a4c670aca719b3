#include <algorithm>
#include <cassert>

#include "server/session/session.h"

namespace weft {

// False where none waits.
bool Session::execute_command() {
  std::unique_lock lock(mutex_);
  std::optional<Command> command = queue_.pop();
  lock.unlock();
  if (!command) return false;
  if (!answer_again(*command)) std::visit([&](auto& next) { execute(std::move(next)); }, *command);
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
    const auto* known = answers_.find(request);
    StepCommand* step = known == nullptr ? queue_.find_step(request) : nullptr;
    if (known == nullptr && step == nullptr) return false;
    if ((step != nullptr ? step->request.checksum : known->checksum) != request.checksum) {
      outcome = refuse(Refusal::Why::kRequestUsed);
    } else if (known != nullptr) {
      outcome = known->answer;
    } else {
      step->done = [first = std::move(step->done), again = std::move(done)](const Outcome& both) {
        first(both);
        again(both);
      };
      return true;
    }
  }
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
  PublishLimit limit;
  {
    std::lock_guard lock(mutex_);
    entry.frame = latest();
    limit = audience_.limit_at(limit_after(entry.event), Clock::now());
    journal_.begin([this, then = std::move(then)](const std::string& error) {
      if (error.empty()) ++timeline_.entries;
      then(error);
    });
  }
  log_->write(entry, limit, [self = shared_from_this(), limit](const std::string& error) {
    {
      std::lock_guard lock(self->mutex_);
      if (error.empty()) self->journal_.limit = limit;
      self->journal_.end(error);
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

// How far frames may be published once the event is in the log.
std::int64_t Session::limit_after(const Event& event) const {
  if (const auto* steps = std::get_if<StepsBegun>(&event))
    return latest() + std::min(steps->frames, journal_.ahead.frames());
  if (const auto* run = std::get_if<RunBegun>(&event)) {
    const std::int64_t ahead = latest() + journal_.ahead.frames(run->time_scale);
    return run->until_frame ? std::min(ahead, std::max(*run->until_frame, goal())) : ahead;
  }
  const bool goes_on = std::holds_alternative<TextileSet>(event) ||
                               std::holds_alternative<Acted>(event) ||
                               std::holds_alternative<SnapshotKept>(event)
                           ? active()
                           : std::holds_alternative<StepsEnded>(event) && run_.has_value();
  return goes_on ? std::max(latest(), journal_.limit.frame) : latest();
}

void Session::execute(StepCommand command) {
  std::optional<Refusal> refusal;
  {
    std::lock_guard lock(mutex_);
    if (!closed_) return queue_.push_step(std::move(command));
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

void Session::execute(Judge command) {
  Applied seen = applied(latest());
  seen.judgement = std::make_shared<const Judgement>(timeline_.judge());
  command.done(seen);
}

void Session::execute(SetTextile command) {
  std::optional<Refusal> refusal;
  {
    std::lock_guard lock(mutex_);
    refusal = refusal_of_change();
  }
  if (refusal) return command.done(*refusal);
  const auto edited = command.edit(timeline_.simulation.target_textile(command.sheet));
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
  auto problems = timeline_.simulation.problems_of(command.actions);
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

// Written before the log says so: what it says is there. The session stands still meanwhile.
void Session::execute(KeepSnapshot command) {
  std::shared_ptr<const SessionSnapshot> taken;
  auto refusal = refusal_of(command);
  if (!refusal) {
    taken = snapshot();
    if (!taken) refusal = refusal_of(command);  // closed meanwhile
  }
  if (!taken) return command.done(*refusal);
  if (command.id.empty()) command.id = default_snapshot_id(taken->simulation.frame);
  const auto made = std::make_shared<NamedSnapshot>();
  {
    std::lock_guard lock(mutex_);
    journal_.begin(
        [this, command, made](const std::string& error) { enter(command, *made, error); });
  }
  log_->keep(
      command.id, taken,
      [self = shared_from_this(), made](const std::string& error, const NamedSnapshot& kept) {
        {
          std::lock_guard lock(self->mutex_);
          *made = kept;
          self->journal_.end(error);
        }
        self->wake();
      });
}

// What keeps the snapshot from being taken.
std::optional<Refusal> Session::refusal_of(const KeepSnapshot& command) const {
  std::lock_guard lock(mutex_);
  if (auto refusal = refusal_of_change()) return refusal;
  const std::string id = command.id.empty() ? default_snapshot_id(latest()) : command.id;
  const auto& named = journal_.named;
  const auto same = [&](const NamedSnapshot& each) { return each.id == id; };
  if (std::any_of(named.begin(), named.end(), same)) {
    Refusal refusal = refuse(Refusal::Why::kSnapshotExists);
    refusal.text = id;
    return refusal;
  }
  if (named.size() >= max_snapshots_) return refuse(Refusal::Why::kTooManySnapshots);
  return std::nullopt;
}

// Has the log say that there is the snapshot, where it could be written.
void Session::enter(const KeepSnapshot& command, const NamedSnapshot& made,
                    const std::string& error) {
  const auto not_kept = [this](const std::string& why) {
    std::lock_guard lock(mutex_);
    Refusal refusal = refuse(Refusal::Why::kNotKept);
    refusal.text = why;
    return refusal;
  };
  if (!error.empty()) return command.done(not_kept(error));
  write(command.request, SnapshotKept{command.id},
        [this, command, made, not_kept](const std::string& why) {
          if (!why.empty()) {
            log_->drop(command.id);
            return command.done(not_kept(why));
          }
          Outcome outcome;
          {
            std::lock_guard lock(mutex_);
            auto& named = journal_.named;
            const auto after =
                std::find_if(named.begin(), named.end(),
                             [&](const NamedSnapshot& each) { return each.frame > made.frame; });
            named.insert(after, made);
            outcome = applied(latest());
          }
          answer(command.request, command.done, outcome);
        });
}

// The answer to the first step; absent while it is under way, or to be begun.
std::optional<Outcome> Session::outcome_of(const CommandQueue::Step& step) const {
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
    if (!queue_.has_steps()) return;  // closed meanwhile
    request = queue_.step().command.request;
    event.frames = queue_.step().command.frames;
  }
  write(request, event, [this](const std::string& error) {
    StepCommand command;
    Refusal refusal;
    {
      std::lock_guard lock(mutex_);
      if (!queue_.has_steps()) return;  // closed meanwhile
      if (error.empty()) {
        queue_.step().first = latest() + 1;
        return;
      }
      refusal = refuse(Refusal::Why::kNotKept);
      refusal.text = error;
      command = queue_.pop_step();
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
      if (!queue_.has_steps()) return;  // closed meanwhile
      refusal = refuse(Refusal::Why::kCancelled);
      command = queue_.pop_step();
    }
    command.done(refusal);
  });
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
    run_ = ActiveRun{run.time_scale, run.until_frame, run.until_rest, Clock::now(), latest()};
    set_state(SessionState::kRunning);
    outcome = applied(latest() + 1);
  }
  offer_to_all();
  return outcome;
}

Outcome Session::pause() {
  std::deque<CommandQueue::Step> steps;
  Outcome outcome;
  Refusal interrupted;
  {
    std::lock_guard lock(mutex_);
    interrupted = refuse(Refusal::Why::kInterrupted);
    steps = queue_.take_steps();
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
  Simulation& simulation = timeline_.simulation;
  const auto step = simulation.set_textile(change.sheet, change.textile, change.duration);
  std::lock_guard lock(mutex_);
  if (step) return Refusal{Refusal::Why::kUnstable, latest(), {}, *step, "textile"};
  textiles_ = textiles_of(simulation.scene());
  plan_ = std::make_shared<const Plan>(simulation.plan());
  Applied done = applied(latest() + 1);
  done.textile = change.textile;
  return done;
}

Outcome Session::apply(const Acted& acted) {
  const auto step = timeline_.simulation.act(acted.actions);
  std::lock_guard lock(mutex_);
  if (step) return Refusal{Refusal::Why::kUnstable, latest(), {}, *step, "actions"};
  plan_ = std::make_shared<const Plan>(timeline_.simulation.plan());
  return applied(latest() + 1);
}

// What keeps a session from being changed.
std::optional<Refusal> Session::refusal_of_change() const {
  if (closed_) return refuse(*closed_);
  if (state_ == SessionState::kFailed) return refuse(Refusal::Why::kFailed);
  return std::nullopt;
}

Applied Session::applied(std::int64_t frame) const {
  const Frame& newest = *audience_.newest();
  return {frame, newest.number, newest.time, newest.at_rest, {}, plan_, {}};
}

}  // namespace weft

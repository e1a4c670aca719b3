#include <iterator>
#include <set>

#include "server/session/session.h"

namespace weft {

bool Session::restore(SavedSession saved) {
  const bool begun = saved.snapshot && begin_at(saved);
  if (!begun && saved.first > 0) return false;
  bool repeats = false;
  {
    std::lock_guard lock(mutex_);
    journal_.limit = saved.limit;
    journal_.named = std::move(saved.named);
    if (!begun && saved.log.empty()) return true;
    const auto next = saved.log.begin() + (timeline_.entries - saved.first);
    repeats = next != saved.log.end() || run_ || queue_.has_steps();
    if (repeats) {
      set_state(SessionState::kRestoring);
      restoring_ =
          Restoring{{std::make_move_iterator(next), std::make_move_iterator(saved.log.end())},
                    saved.limit.frame};
    }
    audience_.expect_back(saved.limit, Clock::now() + kHoldAfterRestore);
  }
  if (!repeats) let_go_of_streams();
  wake();
  return true;
}

// Begins where the snapshot was taken, as far as it belongs to the log; false, and nothing done,
// where it does not.
bool Session::begin_at(const SavedSession& saved) {
  const SessionSnapshot& from = *saved.snapshot;
  const auto& log = saved.log;
  const auto entries = static_cast<std::size_t>(from.entries - saved.first);
  const bool fits = from.entries >= saved.first && entries <= log.size() &&
                    (entries == log.size() || log[entries].frame >= from.simulation.frame);
  if (!fits || !timeline_.begin_at(from)) {
    if (notify_) {
      notify_("session " + identity_.id + ": the snapshot of frame " +
              std::to_string(from.simulation.frame) + " does not fit its scene and log");
    }
    return false;
  }
  for (const auto& [request, outcome] : from.answers) answers_.remember(request, outcome);
  const Simulation& simulation = timeline_.simulation;
  const auto frame = timeline_.make_frame(timeline_.repairs_of_frame(), false);
  std::lock_guard lock(mutex_);
  audience_.begin(frame);
  repairs_ = simulation.repairs();
  plan_ = std::make_shared<const Plan>(simulation.plan());
  textiles_ = textiles_of(simulation.scene());
  for (const LogEntry& entry : from.under_way) {
    if (const auto* run = std::get_if<RunBegun>(&entry.event)) {
      run_ = ActiveRun{run->time_scale, run->until_frame, run->until_rest, Clock::now(), latest()};
    } else if (const auto* steps = std::get_if<StepsBegun>(&entry.event)) {
      StepCommand command;
      command.frames = steps->frames;
      command.request = entry.request;
      command.done = [](const Outcome&) {};
      queue_.push_step(std::move(command), entry.frame + 1);
    }
  }
  return true;
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
        if ((run_ || queue_.step_begun()) && latest() < restoring_->frame) return false;
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
    if (run_) run_->restart(Clock::now(), latest());
  }
  offer_to_all();
  return true;
}

void Session::apply_again(const LogEntry& entry) {
  ++timeline_.entries;
  const Done nobody = [](const Outcome&) {};
  if (const auto* begun = std::get_if<StepsBegun>(&entry.event)) {
    StepCommand command;
    command.frames = begun->frames;
    command.request = entry.request;
    command.done = nobody;
    std::lock_guard lock(mutex_);
    queue_.push_step(std::move(command), latest() + 1);
  } else if (std::holds_alternative<StepsEnded>(entry.event)) {
    std::lock_guard lock(mutex_);
    if (queue_.has_steps()) queue_.pop_step();
  } else {
    answer(entry.request, nobody, apply(entry.event));
  }
}

// The streams of an earlier process are gone.
void Session::let_go_of_streams() {
  std::set<int> hands;
  for (const Grip& grip : timeline_.simulation.constraints().grips) hands.insert(grip.hand);
  hands.erase(0);
  std::lock_guard lock(mutex_);
  for (const int hand : hands) {
    const Action action{.kind = Action::Kind::kLetGo, .hand = hand};
    queue_.push_front(Act{{action}, {}, [](const Outcome&) {}});
  }
}

void Session::offer_snapshot() {
  std::int64_t oldest = 0;
  {
    std::lock_guard lock(mutex_);
    oldest = journal_.limit.history_from.value_or(audience_.oldest());
  }
  if (log_->offer([this] { return snapshot(); }, oldest)) timeline_.note_snapshot();
}

// nullptr where it failed or was closed, which ends in it what is to go on after a restart.
std::shared_ptr<const SessionSnapshot> Session::snapshot() const {
  auto made = std::make_shared<SessionSnapshot>();
  made->entries = timeline_.entries;
  made->create_time = std::chrono::system_clock::now();
  made->simulation = timeline_.simulation.snapshot();
  answers_.for_each([&](const Request& request, const Outcome& outcome) {
    made->answers.push_back({request, outcome});
  });
  std::lock_guard lock(mutex_);
  if (closed_ || state_ == SessionState::kFailed) return nullptr;
  if (run_) {
    made->under_way.push_back(
        {latest(), {}, RunBegun{run_->time_scale, run_->until_frame, run_->until_rest}});
  }
  if (queue_.step_begun()) {
    const CommandQueue::Step& step = queue_.step();
    made->under_way.push_back(
        {*step.first - 1, step.command.request, StepsBegun{step.command.frames}});
  }
  return made;
}

}  // namespace weft

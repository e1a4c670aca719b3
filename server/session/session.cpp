#include "server/session/session.h"

#include <algorithm>
#include <limits>
#include <new>
#include <random>

namespace weft {
namespace {

// 128 random bits in hexadecimal.
std::string make_uid() {
  std::random_device random;
  std::string uid;
  for (int i = 0; i < 32; ++i) uid += "0123456789abcdef"[random() % 16];
  return uid;
}

std::vector<Textile> textiles_of(const Scene& scene) {
  std::vector<Textile> textiles;
  for (const auto& sheet : scene.sheets) textiles.push_back(sheet.textile);
  return textiles;
}

}  // namespace

Session::Session(std::string id, Simulation simulation, std::size_t history_bytes,
                 Scheduler& scheduler)
    : id_(std::move(id)),
      uid_(make_uid()),
      scheduler_(scheduler),
      simulation_(std::move(simulation)),
      scene_(simulation_.scene()),
      textiles_(textiles_of(scene_)),
      plan_(std::make_shared<const Plan>(simulation_.plan())),
      history_(history_bytes) {
  history_.push(make_frame(), 0);
}

SessionStatus Session::status() const {
  std::lock_guard lock(mutex_);
  return {state_, history_.latest(), textiles_, plan_, failure_};
}

void Session::submit(Command command) {
  std::optional<Refusal> refusal;
  {
    std::lock_guard lock(mutex_);
    if (closed_) {
      refusal = refuse(*closed_);
    } else if (commands_.size() + steps_.size() >= kMaxCommands) {
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
    execute_commands();
    settle_steps();
    const auto due = next_due();
    if (!due || *due > Clock::now()) return due;
    compute_frame();
  } catch (const std::bad_alloc&) {
    fail("the server ran out of memory");
  }
  settle_steps();
  return next_due();
}

void Session::fail(const std::string& why) {
  {
    std::lock_guard lock(mutex_);
    failure_ = why + "; frame " + std::to_string(latest()) + " is the last";
    run_.reset();
    set_state(SessionState::kFailed);
  }
  offer_to_all();
}

void Session::execute_commands() {
  for (;;) {
    std::optional<Command> command;
    {
      std::lock_guard lock(mutex_);
      if (commands_.empty()) return;
      command = std::move(commands_.front());
      commands_.pop_front();
    }
    if (!answer_again(*command)) {
      std::visit([&](auto& next) { execute(std::move(next)); }, *command);
    }
  }
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
  Outcome outcome;
  {
    std::lock_guard lock(mutex_);
    if (closed_) {
      outcome = refuse(*closed_);
    } else if (state_ == SessionState::kFailed) {
      outcome = refuse(Refusal::Why::kFailed);
    } else if (command.until_frame && *command.until_frame <= latest()) {
      outcome = refuse(Refusal::Why::kNotAhead);
    } else {
      run_ =
          Run{command.time_scale, command.until_frame, command.until_rest, Clock::now(), latest()};
      set_state(SessionState::kRunning);
      outcome = applied(latest() + 1);
    }
  }
  offer_to_all();
  answer(command.request, command.done, outcome);
}

void Session::execute(PauseCommand command) {
  std::deque<Step> steps;
  Outcome outcome;
  Refusal interrupted;
  {
    std::lock_guard lock(mutex_);
    interrupted = refuse(Refusal::Why::kInterrupted);
    if (closed_) {
      outcome = refuse(*closed_);
    } else if (state_ == SessionState::kFailed) {
      outcome = refuse(Refusal::Why::kFailed);
    } else {
      steps.swap(steps_);
      run_.reset();
      set_state(SessionState::kPaused);
      outcome = applied(latest() + 1);
    }
  }
  offer_to_all();
  for (const auto& step : steps) {
    // one that had begun is not begun again
    const Request request = step.first ? step.command.request : Request{};
    answer(request, step.command.done, interrupted);
  }
  answer(command.request, command.done, outcome);
}

void Session::execute(SetTextile command) {
  Outcome outcome;
  const auto change = [&]() -> Outcome {
    {
      std::lock_guard lock(mutex_);
      if (closed_) return refuse(*closed_);
      if (state_ == SessionState::kFailed) return refuse(Refusal::Why::kFailed);
    }
    const auto edited = command.edit(simulation_.scene().sheets[command.sheet].textile);
    std::optional<StepRefusal> step;
    if (const auto* textile = std::get_if<Textile>(&edited)) {
      step = simulation_.set_textile(command.sheet, *textile);
    }
    std::lock_guard lock(mutex_);
    if (const auto* problems = std::get_if<std::vector<Problem>>(&edited)) {
      return Refusal{Refusal::Why::kInvalid, latest(), *problems, {}};
    }
    if (step) return Refusal{Refusal::Why::kUnstable, latest(), {}, *step};
    textiles_[command.sheet] = std::get<Textile>(edited);
    plan_ = std::make_shared<const Plan>(simulation_.plan());
    Applied done = applied(latest() + 1);
    done.textile = textiles_[command.sheet];
    return done;
  };
  answer(command.request, command.done, change());
}

// Answers steps that are done, and begins the next one.
void Session::settle_steps() {
  std::vector<std::pair<StepCommand, Outcome>> settled;
  {
    std::lock_guard lock(mutex_);
    std::erase_if(steps_, [&](Step& step) {
      if (!step.command.cancelled.stop_requested()) return false;
      settled.emplace_back(std::move(step.command), refuse(Refusal::Why::kCancelled));
      return true;
    });
    while (!steps_.empty()) {
      auto outcome = settle(steps_.front());
      if (!outcome) break;
      settled.emplace_back(std::move(steps_.front().command), std::move(*outcome));
      steps_.pop_front();
    }
  }
  for (const auto& [command, outcome] : settled) answer(command.request, command.done, outcome);
}

// The answer to the first step; absent while it is under way.
std::optional<Outcome> Session::settle(Step& step) const {
  const auto& command = step.command;
  if (state_ == SessionState::kFailed) return refuse(Refusal::Why::kFailed);
  if (!step.first) {
    if (state_ == SessionState::kRunning) return refuse(Refusal::Why::kRunning);
    if (command.expected_frame && *command.expected_frame != latest()) {
      return refuse(Refusal::Why::kStale);
    }
    step.first = latest() + 1;
  }
  if (latest() - *step.first + 1 < command.frames) return std::nullopt;
  return applied(*step.first);
}

void Session::compute_frame() {
  if (!simulation_.advance_frame()) {
    return fail("the solver diverged in frame " + std::to_string(simulation_.frame() + 1) +
                ": a position stopped being finite");
  }
  const auto frame = make_frame();
  {
    std::lock_guard lock(mutex_);
    if (closed_) return;
    history_.push(frame, first_held_frame());
    if (run_ && reached(*run_)) {
      run_.reset();
      set_state(SessionState::kPaused);
    }
  }
  offer_to_all();
}

// When the next frame is to be computed; nullopt: not before something happens.
std::optional<Clock::time_point> Session::next_due() {
  std::lock_guard lock(mutex_);
  if (closed_ || (steps_.empty() && !run_)) return std::nullopt;
  if (history_.full() && first_held_frame() <= history_.oldest()) {
    held_ = true;
    return std::nullopt;
  }
  if (!steps_.empty() || !run_->time_scale) return Clock::time_point::min();
  const double frames = static_cast<double>(latest() + 1 - run_->start_frame);
  const std::chrono::duration<double> since_start =
      std::chrono::duration<double>(frames * scene_.solver.frame_step / *run_->time_scale);
  return run_->start_time + std::chrono::duration_cast<Clock::duration>(since_start);
}

std::shared_ptr<const Frame> Session::make_frame() const {
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
  return frame;
}

void Session::set_state(SessionState state) {
  if (state != state_) ++state_changes_;
  state_ = state;
}

bool Session::reached(const Run& run) const {
  return (run.until_frame && latest() >= *run.until_frame) ||
         (run.until_rest && history_.latest()->at_rest);
}

// First frame that a subscriber with HOLD_SESSION still needs.
std::int64_t Session::first_held_frame() const {
  auto first = std::numeric_limits<std::int64_t>::max();
  for (const Subscription* subscription : subscriptions_) {
    if (subscription->policy_ == SlowReader::kHoldSession) {
      first = std::min(first, subscription->next_);
    }
  }
  return first;
}

Applied Session::applied(std::int64_t frame) const {
  const Frame& newest = *history_.latest();
  return {frame, newest.number, newest.time, newest.at_rest, {}, plan_};
}

Progress Session::progress() const {
  return {history_.oldest(), latest(), state_, history_.latest()->at_rest, state_changes_};
}

}  // namespace weft

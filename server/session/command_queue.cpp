#include "server/session/command_queue.h"

#include <algorithm>

namespace weft {
namespace {

// Whether the command has no caller who could send it again.
bool must_be_carried_out(const Command& command) {
  const auto* act = std::get_if<Act>(&command);
  return act != nullptr && !act->actions.empty() &&
         act->actions.front().kind == Action::Kind::kLetGo;
}

}  // namespace

bool CommandQueue::push(Command& command) {
  if (commands_.size() + steps_.size() >= kMost && !must_be_carried_out(command)) return false;
  commands_.push_back(std::move(command));
  return true;
}

std::optional<Command> CommandQueue::pop() {
  if (commands_.empty()) return std::nullopt;
  std::optional<Command> command = std::move(commands_.front());
  commands_.pop_front();
  return command;
}

bool CommandQueue::has_pause() const {
  return std::any_of(commands_.begin(), commands_.end(), [](const Command& command) {
    return std::holds_alternative<PauseCommand>(command);
  });
}

StepCommand CommandQueue::pop_step() {
  StepCommand command = std::move(steps_.front().command);
  steps_.pop_front();
  return command;
}

std::vector<StepCommand> CommandQueue::take_cancelled() {
  std::vector<StepCommand> cancelled;
  std::erase_if(steps_, [&](Step& step) {
    if (step.first || !step.command.cancelled.stop_requested()) return false;
    cancelled.push_back(std::move(step.command));
    return true;
  });
  return cancelled;
}

StepCommand* CommandQueue::find_step(const Request& request) {
  for (Step& step : steps_)
    if (step.command.request.id == request.id) return &step.command;
  return nullptr;
}

}  // namespace weft

#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "server/session/command.h"

namespace weft {

// Calls that a session has not carried out: commands in the order in which they came, and steps,
// the first of which may be under way. Not thread-safe.
class CommandQueue {
 public:
  // Commands that may wait.
  static constexpr std::size_t kMost = 256;

  struct Step {
    StepCommand command;
    std::optional<std::int64_t> first;  // frame; absent: not begun
  };

  bool empty() const { return commands_.empty() && steps_.empty(); }
  // False, and nothing done, where too many wait.
  [[nodiscard]] bool push(Command& command);
  void push_front(Command command) { commands_.push_front(std::move(command)); }
  // The next command; none: none waits.
  std::optional<Command> pop();
  bool has_pause() const;

  void push_step(StepCommand command, std::optional<std::int64_t> first = {}) {
    steps_.push_back({std::move(command), first});
  }
  bool has_steps() const { return !steps_.empty(); }
  Step& step() { return steps_.front(); }
  const Step& step() const { return steps_.front(); }
  StepCommand pop_step();
  bool step_begun() const { return has_steps() && step().first; }
  // Whether the caller of the step under way went away.
  bool step_cancelled() const { return step_begun() && step().command.cancelled.stop_requested(); }
  // Last frame of the step under way. Precondition: step_begun().
  std::int64_t last_frame() const { return *step().first + step().command.frames - 1; }
  // Steps that have not begun and whose callers went away.
  std::vector<StepCommand> take_cancelled();
  // A step with that request, or nullptr.
  StepCommand* find_step(const Request& request);

  std::deque<Step> take_steps() { return std::exchange(steps_, {}); }
  std::deque<Command> take_commands() { return std::exchange(commands_, {}); }

 private:
  std::deque<Command> commands_;
  std::deque<Step> steps_;
};

}  // namespace weft

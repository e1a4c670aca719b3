#include "server/session/command_queue.h"

#include <gmock/gmock.h>

namespace weft {
namespace {

StepCommand step_of(std::int64_t frames, const std::string& request = {},
                    const std::stop_token& cancelled = {}) {
  StepCommand step;
  step.frames = frames;
  step.cancelled = cancelled;
  step.request.id = request;
  return step;
}

bool push(CommandQueue& queue, Command command) { return queue.push(command); }

TEST(CommandQueue, CommandsComeInTheOrderInWhichTheyWent) {
  CommandQueue queue;
  EXPECT_TRUE(queue.empty());
  ASSERT_TRUE(push(queue, RunCommand{}));
  ASSERT_TRUE(push(queue, PauseCommand{}));
  EXPECT_TRUE(queue.has_pause());
  EXPECT_TRUE(std::holds_alternative<RunCommand>(*queue.pop()));
  EXPECT_TRUE(std::holds_alternative<PauseCommand>(*queue.pop()));
  EXPECT_FALSE(queue.pop());
}

TEST(CommandQueue, IsBoundedButForGripsThatAreLetGo) {
  CommandQueue queue;
  queue.push_step(step_of(1));
  for (std::size_t i = 1; i < CommandQueue::kMost; ++i) ASSERT_TRUE(push(queue, RunCommand{}));
  EXPECT_FALSE(push(queue, RunCommand{}));
  EXPECT_TRUE(push(queue, Act{{{.kind = Action::Kind::kLetGo}}, {}, {}}));
}

TEST(CommandQueue, TheFirstStepIsUnderWayOnceItHasBegun) {
  CommandQueue queue;
  queue.push_step(step_of(5));
  EXPECT_TRUE(queue.has_steps());
  EXPECT_FALSE(queue.step_begun());
  queue.step().first = 11;
  EXPECT_TRUE(queue.step_begun());
  EXPECT_EQ(queue.last_frame(), 15);
  EXPECT_EQ(queue.pop_step().frames, 5);
  EXPECT_TRUE(queue.empty());
}

TEST(CommandQueue, StepsWhoseCallersWentAwayAreTakenOutUnlessTheyHaveBegun) {
  CommandQueue queue;
  std::stop_source gone;
  queue.push_step(step_of(1, {}, gone.get_token()), 1);
  queue.push_step(step_of(2, {}, gone.get_token()));
  queue.push_step(step_of(3));
  EXPECT_FALSE(queue.step_cancelled());
  gone.request_stop();
  EXPECT_TRUE(queue.step_cancelled());
  const auto cancelled = queue.take_cancelled();
  ASSERT_EQ(cancelled.size(), 1U);
  EXPECT_EQ(cancelled[0].frames, 2);
  EXPECT_EQ(queue.take_steps().size(), 2U);
}

TEST(CommandQueue, AStepIsFoundByItsRequest) {
  CommandQueue queue;
  queue.push_step(step_of(1, "a"));
  queue.push_step(step_of(2, "b"));
  ASSERT_NE(queue.find_step({"b", 0}), nullptr);
  EXPECT_EQ(queue.find_step({"b", 0})->frames, 2);
  EXPECT_EQ(queue.find_step({"c", 0}), nullptr);
}

}  // namespace
}  // namespace weft

#include "server/session/scheduler.h"

#include <gmock/gmock.h>

#include <atomic>
#include <future>
#include <latch>
#include <string>

namespace weft::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

// Notes its letter for each slice, and wants as many as it is given.
class Letter : public Task {
 public:
  Letter(char letter, int slices, std::string& log, std::latch& done)
      : letter_(letter), slices_(slices), log_(log), done_(done) {}
  std::optional<Clock::time_point> run_slice() override {
    log_ += letter_;
    if (--slices_ > 0) return Clock::time_point::min();
    done_.count_down();
    return std::nullopt;
  }

 private:
  char letter_;
  int slices_;
  std::string& log_;
  std::latch& done_;
};

class Lambda : public Task {
 public:
  explicit Lambda(std::function<std::optional<Clock::time_point>()> slice)
      : slice_(std::move(slice)) {}
  std::optional<Clock::time_point> run_slice() override { return slice_(); }

 private:
  std::function<std::optional<Clock::time_point>()> slice_;
};

TEST(Scheduler, GivesBusyTasksTurnsOfOneSlice) {
  std::string log;
  std::latch done(3);
  Scheduler scheduler(1);
  std::promise<void> begin;
  ASSERT_TRUE(scheduler.post([wait = begin.get_future().share()] { wait.wait(); }));
  for (const char letter : {'a', 'b', 'c'}) {
    scheduler.wake(std::make_shared<Letter>(letter, 3, log, done));
  }
  begin.set_value();
  done.wait();
  EXPECT_EQ(log, "abcabcabc");
}

TEST(Scheduler, RunsATaskOnOneThreadAtATimeHoweverOftenItIsWoken) {
  std::atomic<int> inside = 0, most = 0;
  std::atomic<bool> begun = false;
  Scheduler scheduler(4);
  const auto task = std::make_shared<Lambda>([&]() -> std::optional<Clock::time_point> {
    most = std::max(most.load(), ++inside);
    --inside;
    begun = true;
    begun.notify_all();
    return std::nullopt;
  });
  std::vector<std::jthread> wakers;
  for (int i = 0; i < 4; ++i) {
    wakers.emplace_back([&] {
      for (int k = 0; k < 1000; ++k) scheduler.wake(task);
    });
  }
  wakers.clear();
  begun.wait(false);
  scheduler.stop();
  EXPECT_EQ(most, 1);
}

TEST(Scheduler, RunsATaskAgainThatIsWokenDuringItsSlice) {
  std::shared_ptr<Lambda> task;
  std::latch done(2);
  bool first = true;
  Scheduler scheduler(1);
  task = std::make_shared<Lambda>([&]() -> std::optional<Clock::time_point> {
    if (std::exchange(first, false)) scheduler.wake(task);
    done.count_down();
    return std::nullopt;
  });
  scheduler.wake(task);
  done.wait();
  scheduler.stop();
}

TEST(Scheduler, RunsTasksThatWaitInOrderOfTheirTimesAndNotBefore) {
  std::vector<int> order;
  std::latch done(2);
  Scheduler scheduler(1);
  const auto begin = Clock::now();
  const auto later = [&](int number, std::chrono::milliseconds wait) {
    return std::make_shared<Lambda>(
        [&, number, due = begin + wait]() -> std::optional<Clock::time_point> {
          if (Clock::now() < due) return due;
          order.push_back(number);
          done.count_down();
          return std::nullopt;
        });
  };
  scheduler.wake(later(2, 40ms));
  scheduler.wake(later(1, 20ms));
  done.wait();
  EXPECT_GE(Clock::now() - begin, 40ms);
  EXPECT_THAT(order, ElementsAre(1, 2));
}

TEST(Scheduler, RunsATaskAtOnceThatIsWokenWhileItWaits) {
  std::promise<void> waiting, woken;
  int slices = 0;
  Scheduler scheduler(1);
  const auto task = std::make_shared<Lambda>([&]() -> std::optional<Clock::time_point> {
    (++slices == 1 ? waiting : woken).set_value();
    return slices == 1 ? std::optional(Clock::now() + 1h) : std::nullopt;
  });
  scheduler.wake(task);
  waiting.get_future().wait();
  scheduler.wake(task);
  EXPECT_EQ(woken.get_future().wait_for(60s), std::future_status::ready);
}

TEST(Scheduler, RefusesWorkWhenTooMuchIsPosted) {
  std::promise<void> begun, go_on, done;
  std::atomic<std::size_t> runs = 0;
  Scheduler scheduler(1);
  ASSERT_TRUE(scheduler.post([&] {
    begun.set_value();
    go_on.get_future().wait();
  }));
  begun.get_future().wait();
  for (std::size_t i = 0; i < Scheduler::kMaxPosted; ++i) {
    ASSERT_TRUE(scheduler.post([&] {
      if (++runs == Scheduler::kMaxPosted) done.set_value();
    }));
  }
  EXPECT_FALSE(scheduler.post([&] { ++runs; }));
  go_on.set_value();
  done.get_future().wait();
  EXPECT_TRUE(scheduler.post([] {})) << "there is room again";
}

TEST(Scheduler, StopsWhileTasksAreBusy) {
  Scheduler scheduler(2);
  std::latch begun(2);
  const auto busy = [&] {
    return std::make_shared<Lambda>(
        [&, first = true]() mutable -> std::optional<Clock::time_point> {
          if (std::exchange(first, false)) begun.count_down();
          return Clock::time_point::min();
        });
  };
  scheduler.wake(busy());
  scheduler.wake(busy());
  begun.wait();
  scheduler.stop();
}

}  // namespace
}  // namespace weft::testing

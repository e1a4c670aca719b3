#include "server/session/scheduler.h"

#include <gmock/gmock.h>

#include <array>
#include <atomic>
#include <future>
#include <latch>
#include <thread>

namespace weft::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

class Lambda : public Task {
 public:
  explicit Lambda(std::function<std::optional<Clock::time_point>()> slice)
      : slice_(std::move(slice)) {}
  std::optional<Clock::time_point> run_slice() override { return slice_(); }

 private:
  std::function<std::optional<Clock::time_point>()> slice_;
};

TEST(Scheduler, LetsTasksOfShortSlicesRunMoreOfThem) {
  constexpr int kShort = 60;
  Scheduler scheduler(1);
  int longs = 0, shorts = 0;
  std::promise<int> done;
  const auto slow = std::make_shared<Lambda>([&]() -> std::optional<Clock::time_point> {
    std::this_thread::sleep_for(20 * Scheduler::kTurn);
    ++longs;
    return Clock::time_point::min();
  });
  const auto fast = std::make_shared<Lambda>([&]() -> std::optional<Clock::time_point> {
    if (++shorts < kShort) return Clock::time_point::min();
    done.set_value(longs);
    return std::nullopt;
  });
  scheduler.wake(slow);
  scheduler.wake(fast);
  EXPECT_LT(done.get_future().get(), kShort / 2);
  scheduler.stop();
}

TEST(Scheduler, IsUrgentForWhatIsWokenAndHasHadLessTime) {
  Scheduler scheduler(1);
  const auto rested =
      std::make_shared<Lambda>([]() -> std::optional<Clock::time_point> { return std::nullopt; });
  std::promise<std::array<bool, 2>> urgent;  // before it is woken, and after
  const auto busy =
      std::make_shared<Lambda>([&, slices = 0]() mutable -> std::optional<Clock::time_point> {
        if (++slices == 1) {
          std::this_thread::sleep_for(2 * Scheduler::kShare);
          return Clock::time_point::min();
        }
        const bool before = scheduler.urgent();
        scheduler.wake(rested);
        urgent.set_value({before, scheduler.urgent()});
        return std::nullopt;
      });
  scheduler.wake(busy);
  EXPECT_THAT(urgent.get_future().get(), ElementsAre(false, true));
  scheduler.stop();
}

TEST(Scheduler, LetsATaskOfLongSlicesGoOnBesideBusyOnesAndPostedWork) {
  Scheduler scheduler(1);
  std::promise<void> done;
  const auto busy = std::make_shared<Lambda>([] { return Clock::time_point::min(); });
  std::function<void()> again = [&] { (void)scheduler.post(again); };
  const auto slow =
      std::make_shared<Lambda>([&, left = 3]() mutable -> std::optional<Clock::time_point> {
        std::this_thread::sleep_for(20 * Scheduler::kTurn);
        if (--left > 0) return Clock::time_point::min();
        done.set_value();
        return std::nullopt;
      });
  scheduler.wake(busy);
  scheduler.wake(slow);
  ASSERT_TRUE(scheduler.post(again));
  EXPECT_EQ(done.get_future().wait_for(60s), std::future_status::ready);
  scheduler.stop();
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

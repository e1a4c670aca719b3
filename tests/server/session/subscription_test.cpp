#include "server/session/subscription.h"

#include <gmock/gmock.h>

#include <array>
#include <thread>

#include "tests/server/session/session_support.h"

namespace weft::testing {
namespace {

void expect_frames(Watcher& watcher, std::int64_t first, std::int64_t last) {
  for (std::int64_t number = first; number <= last; ++number) {
    const Reading reading = watcher.read();
    ASSERT_EQ(reading.kind, Reading::Kind::kFrame);
    ASSERT_EQ(reading.frame->number, number);
  }
}

TEST(Subscription, GetsEveryFrameOnceAndInOrderWhileTheSessionRuns) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  const auto watcher = Watcher::of(*session, 0);
  run(*session, 200).applied();
  expect_frames(*watcher, 0, 200);
}

TEST(Subscription, BeginsAtTheNewestFrameOrWhereItIsAsked) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  step(*session, 10).applied();
  EXPECT_EQ(Watcher::of(*session, {})->read().frame->number, 10);
  EXPECT_EQ(Watcher::of(*session, 4)->read().frame->number, 4);
  const auto ahead = Watcher::of(*session, 12);
  EXPECT_EQ(ahead->subscription().read().kind, Reading::Kind::kNothingYet);
  step(*session, 5).applied();
  expect_frames(*ahead, 12, 15);
}

TEST(Subscription, ManyShareTheSameFrames) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  const auto one = Watcher::of(*session, 0), two = Watcher::of(*session, 0);
  step(*session, 5).applied();
  for (int i = 0; i <= 5; ++i) EXPECT_EQ(one->read().frame, two->read().frame);
}

TEST(Subscription, ASlowOneExpires) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler, hung_scene(), history_of(5));
  const auto watcher = Watcher::of(*session, 0);
  step(*session, 20).applied();
  const Reading reading = watcher->read();
  EXPECT_EQ(reading.kind, Reading::Kind::kExpired);
  EXPECT_EQ(reading.progress.oldest_frame, 16);
  EXPECT_EQ(reading.progress.latest_frame, 20);
}

TEST(Subscription, ASlowOneThatHoldsTheSessionMissesNothing) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler, hung_scene(), history_of(5));
  const auto watcher = Watcher::of(*session, 0, SlowReader::kHoldSession);
  Answer stepping = step(*session, 100);
  watcher->wait_for_frame(4);
  EXPECT_FALSE(stepping.is_there());
  EXPECT_LE(watcher->subscription().progress().latest_frame, 5) << "it did not wait";
  expect_frames(*watcher, 0, 100);
  stepping.applied();
}

TEST(Subscription, ASessionThatIsHeldStillAnswersCalls) {
  Scheduler scheduler(1);
  const auto session = make_session(scheduler, hung_scene(), history_of(5));
  const auto watcher = Watcher::of(*session, 0, SlowReader::kHoldSession);
  run(*session).applied();
  watcher->wait_for_frame(4);
  EXPECT_EQ(pause(*session).applied().newest, 4);
}

TEST(Subscription, LeavingReleasesTheSession) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler, hung_scene(), history_of(5));
  const auto watcher = Watcher::of(*session, 0, SlowReader::kHoldSession);
  Answer stepping = step(*session, 100);
  watcher->wait_for_frame(4);
  watcher->leave();
  EXPECT_EQ(stepping.applied().newest, 100);
}

TEST(Subscription, OfAFailedSessionEndsAfterTheLastGoodFrame) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler, diverging_scene());
  const auto watcher = Watcher::of(*session, 0);
  run(*session).applied();
  watcher->wait_for_state(SessionState::kFailed);
  expect_frames(*watcher, 0, session->status().newest->number);
  EXPECT_EQ(watcher->read().kind, Reading::Kind::kFailed);
}

TEST(Subscription, OfADeletedSessionEnds) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  const auto watcher = Watcher::of(*session, 100);
  session->close(Refusal::Why::kDeleted);
  EXPECT_EQ(watcher->read().kind, Reading::Kind::kDeleted);
}

TEST(Subscription, OneThatSkipsGetsTheNewestFrameWhateverIsKept) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler, hung_scene(), history_of(5));
  const auto watcher = Watcher::of(*session, {}, SlowReader::kSkip);
  EXPECT_EQ(watcher->read().frame->number, 0);
  EXPECT_EQ(watcher->subscription().read().kind, Reading::Kind::kNothingYet);
  step(*session, 20).applied();
  EXPECT_EQ(watcher->subscription().read(false).kind, Reading::Kind::kNothingYet);
  const Reading reading = watcher->read();
  EXPECT_EQ(reading.frame->number, 20);
  EXPECT_EQ(reading.skipped, 19);
  session->close(Refusal::Why::kDeleted);
  EXPECT_EQ(watcher->subscription().read(false).kind, Reading::Kind::kDeleted);
}

TEST(Subscription, ManyComeAndGoWhileTheSessionRuns) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler, hung_scene(), history_of(50));
  const auto keeper = Watcher::of(*session, 0);
  run(*session).applied();
  std::vector<std::jthread> threads;
  for (int i = 0; i < 6; ++i) {
    threads.emplace_back([&, i] {
      for (int k = 0; k < 20; ++k) {
        const auto policy = std::array{SlowReader::kHoldSession, SlowReader::kDisconnect,
                                       SlowReader::kSkip}[static_cast<std::size_t>(i) % 3];
        const auto watcher = Watcher::of(*session, {}, policy);
        std::int64_t last = -1;
        for (int n = 0; n < 5; ++n) {
          const Reading reading = watcher->read();
          if (reading.kind == Reading::Kind::kExpired && i % 3 == 1) break;
          ASSERT_EQ(reading.kind, Reading::Kind::kFrame);
          if (last >= 0) {
            ASSERT_EQ(reading.frame->number, last + 1 + reading.skipped);
          }
          last = reading.frame->number;
        }
      }
    });
  }
  threads.clear();
  pause(*session).applied();
}

}  // namespace
}  // namespace weft::testing

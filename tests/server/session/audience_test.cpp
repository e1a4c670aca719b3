#include "server/session/audience.h"

#include <gmock/gmock.h>

#include <chrono>
#include <memory>

#include "tests/server/session/session_support.h"

namespace weft {
namespace {

using std::chrono::seconds;

std::shared_ptr<const Frame> frame(std::int64_t number) {
  auto made = std::make_shared<Frame>();
  made->number = number;
  made->positions.resize(300);
  return made;
}

class AudienceTest : public ::testing::Test {
 protected:
  AudienceTest() { audience_.begin(frame(0)); }
  void push(int frames) {
    for (int i = 0; i < frames; ++i) audience_.push(frame(audience_.latest() + 1), now_);
  }
  void read_up_to(std::int64_t last, FrameReader& reader) {
    while (reader.next <= last) ASSERT_TRUE(audience_.take_next(reader).frame);
  }

  static constexpr std::size_t kKept = 10;
  Clock::time_point now_ = Clock::now();
  Audience audience_{testing::history_for(kKept * frame(0)->bytes()), seconds(60)};
};

TEST_F(AudienceTest, AReaderFindsEveryFrameOnceAndThenNone) {
  FrameReader reader{{}, 0, SlowReader::kDisconnect};
  audience_.add(reader, now_);
  push(2);
  for (const int number : {0, 1, 2}) EXPECT_EQ(audience_.take_next(reader).frame->number, number);
  const auto found = audience_.take_next(reader);
  EXPECT_FALSE(found.frame);
  EXPECT_FALSE(found.expired);
}

TEST_F(AudienceTest, ASlowReaderLosesFramesAndAViewSkipsThem) {
  FrameReader slow{{}, 0, SlowReader::kDisconnect}, view{{}, 0, SlowReader::kSkip};
  audience_.add(slow, now_);
  audience_.add(view, now_);
  push(20);
  EXPECT_TRUE(audience_.take_next(slow).expired);
  const auto found = audience_.take_next(view);
  EXPECT_EQ(found.frame->number, 20);
  EXPECT_EQ(found.skipped, 20);
}

TEST_F(AudienceTest, AHolderMakesTheSessionWaitWhileHalfOfTheHistoryIsUnread) {
  FrameReader holder{{}, 0, SlowReader::kHoldSession};
  audience_.add(holder, now_);
  while (!audience_.must_hold(now_)) push(1);
  EXPECT_EQ(audience_.latest(), 9);
  EXPECT_EQ(audience_.oldest(), 0);
  read_up_to(4, holder);
  EXPECT_FALSE(audience_.must_hold(now_));
  audience_.remove(holder);
  push(100);
  EXPECT_FALSE(audience_.must_hold(now_));
}

TEST_F(AudienceTest, TheLogIsToldWhatReadersMayWantAgain) {
  EXPECT_FALSE(audience_.limit_at(16, now_).history_from);
  FrameReader reader{{}, 0, SlowReader::kHoldSession};
  audience_.add(reader, now_);
  EXPECT_FALSE(audience_.knows_holders({}, now_));
  push(5);
  PublishLimit limit = audience_.limit_at(16, now_);
  EXPECT_EQ(limit.frame, 16);
  EXPECT_EQ(limit.holders, 1);
  EXPECT_EQ(limit.readers, 1);
  EXPECT_EQ(limit.history_from, 0);
  EXPECT_TRUE(audience_.knows_holders(limit, now_) && audience_.knows_readers(limit, now_));

  // what it was sent a minute ago has come to it, or it is not coming back
  read_up_to(5, reader);
  EXPECT_EQ(audience_.limit_at(16, now_ + seconds(30)).history_from, 0);
  EXPECT_EQ(audience_.limit_at(16, now_ + seconds(91)).history_from, 5);
}

// The log is told of it some time after it has come, and it reads meanwhile.
TEST_F(AudienceTest, AReaderMayWantAllAgainThatItWasSentBeforeTheLogWasTold) {
  push(9);
  FrameReader early{{}, 2, SlowReader::kHoldSession}, late{{}, 8, SlowReader::kDisconnect};
  audience_.add(late, now_);
  audience_.add(early, now_);
  read_up_to(9, early);
  read_up_to(9, late);
  EXPECT_EQ(audience_.limit_at(16, now_).history_from, 2);
  EXPECT_EQ(audience_.limit_at(16, now_ + seconds(59)).history_from, 2);
  EXPECT_EQ(audience_.limit_at(16, now_ + seconds(120)).history_from, 9);
}

TEST_F(AudienceTest, AfterARestartAReaderMayWantAllAgainFromWhereItCameBack) {
  PublishLimit left;
  left.readers = 2;
  left.history_from = 1;
  audience_.expect_back(left, now_ + seconds(30));
  push(9);
  FrameReader early{{}, 3, SlowReader::kDisconnect}, late{{}, 8, SlowReader::kDisconnect};
  audience_.add(early, now_);
  read_up_to(9, early);
  EXPECT_EQ(audience_.limit_at(16, now_).history_from, 1);
  audience_.add(late, now_);
  EXPECT_EQ(audience_.limit_at(16, now_).history_from, 3);
}

TEST_F(AudienceTest, AfterARestartHoldersAreWaitedForUntilTheyComeOrTheTimeIsOver) {
  PublishLimit left;
  left.holders = left.readers = 1;
  left.history_from = 0;
  audience_.expect_back(left, now_ + seconds(30));
  push(9);
  EXPECT_TRUE(audience_.must_hold(now_));
  EXPECT_EQ(audience_.holds_until(now_), now_ + seconds(30));
  EXPECT_FALSE(audience_.must_hold(now_ + seconds(30)));

  audience_.expect_back(left, now_ + seconds(30));
  FrameReader holder{{}, 9, SlowReader::kHoldSession};
  audience_.add(holder, now_);
  EXPECT_FALSE(audience_.must_hold(now_));
  EXPECT_EQ(audience_.limit_at(20, now_).holders, 1);
}

}  // namespace
}  // namespace weft

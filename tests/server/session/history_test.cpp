#include "server/session/history.h"

#include <gmock/gmock.h>

#include <limits>

namespace weft::testing {
namespace {

constexpr auto kKeepNone = std::numeric_limits<std::int64_t>::max();

std::shared_ptr<const Frame> frame(std::int64_t number) {
  auto made = std::make_shared<Frame>();
  made->number = number;
  made->positions.resize(30);
  made->velocities.resize(30);
  return made;
}

const std::size_t kFrameBytes = frame(0)->bytes();

// For so many frames, of all and of each.
std::shared_ptr<HistoryBudget> budget(std::size_t frames) {
  return std::make_shared<HistoryBudget>(frames * kFrameBytes, frames * kFrameBytes);
}

std::size_t kept(const History& history) {
  return static_cast<std::size_t>(history.latest()->number - history.oldest() + 1);
}

TEST(History, DropsTheOldestFramesThatDoNotFit) {
  History history(budget(5));
  for (int i = 0; i < 100; ++i) history.push(frame(i), kKeepNone);
  EXPECT_EQ(history.oldest(), 95);
  EXPECT_EQ(history.latest()->number, 99);
  EXPECT_EQ(history.find(94), nullptr);
  EXPECT_EQ(history.find(97)->number, 97);
  EXPECT_EQ(history.find(100), nullptr);
}

TEST(History, KeepsTwoFramesHoweverLargeTheyAre) {
  History history(budget(0));
  for (int i = 0; i < 5; ++i) history.push(frame(i), kKeepNone);
  EXPECT_EQ(history.oldest(), 3);
  EXPECT_TRUE(history.full());
}

TEST(History, KeepsWhatItIsAskedToKeep) {
  History history(budget(3));
  for (int i = 0; i < 10; ++i) history.push(frame(i), 4);
  EXPECT_EQ(history.oldest(), 4);
}

TEST(History, CountsTheEncodingsOfItsFrames) {
  History history(budget(5));
  for (int i = 0; i < 5; ++i) history.push(frame(i), kKeepNone);
  EXPECT_EQ(history.oldest(), 0);
  history.latest()->encodings.get("0", [] {
    return Encoding{std::make_shared<int>(1), 2 * kFrameBytes};
  });
  history.push(frame(5), kKeepNone);
  EXPECT_EQ(history.oldest(), 3) << "two frames of room went to the encoding";
}

TEST(History, SharesABudgetOfWhichThoseThatAreReadGetFourTimesAsMuch) {
  const auto shared = budget(20);
  History first(shared);
  for (int i = 0; i < 50; ++i) first.push(frame(i), kKeepNone);
  EXPECT_EQ(kept(first), 20U);
  {
    History second(shared);
    for (int i = 0; i < 50; ++i) second.push(frame(i), kKeepNone);
    EXPECT_EQ(kept(second), 10U);
    EXPECT_TRUE(shared->exceeded()) << "the first one has not made room yet";
    first.trim(kKeepNone);
    EXPECT_EQ(kept(first), 10U);
    EXPECT_FALSE(shared->exceeded());

    second.set_read(true);
    first.trim(kKeepNone);
    for (int i = 50; i < 99; ++i) second.push(frame(i), kKeepNone);
    EXPECT_EQ(kept(first), 4U);
    EXPECT_EQ(kept(second), 16U);
    EXPECT_EQ(shared->meter()->bytes(), 20 * kFrameBytes);
  }
  for (int i = 50; i < 99; ++i) first.push(frame(i), kKeepNone);
  EXPECT_EQ(kept(first), 20U) << "what the other one had is free again";
}

TEST(EncodingCache, MakesEachEncodingOnceAndLetsItGoWithTheFrame) {
  std::weak_ptr<const void> held;
  {
    const auto made = frame(0);
    int calls = 0;
    const auto make = [&] {
      ++calls;
      return Encoding{std::make_shared<int>(calls), 4};
    };
    const auto one = made->encodings.get("7", make);
    EXPECT_EQ(made->encodings.get("7", make), one);
    EXPECT_EQ(calls, 1);
    EXPECT_NE(made->encodings.get("8", make), one);
    held = one;
  }
  EXPECT_TRUE(held.expired());
}

}  // namespace
}  // namespace weft::testing

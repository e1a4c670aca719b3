#include "server/session/run.h"

#include <gtest/gtest.h>

#include "server/session/journal.h"

namespace weft {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(ActiveRun, AtAPaceFramesAreDueFromWhereItBegan) {
  const auto start = Clock::now();
  ActiveRun run{2.0, {}, false, start, 10};
  EXPECT_EQ(run.due(11, 0.02), start + milliseconds(10));
  EXPECT_EQ(run.due(110, 0.02), start + seconds(1));
  run.restart(start + seconds(5), 50);
  EXPECT_EQ(run.due(51, 0.02), start + seconds(5) + milliseconds(10));
  run.time_scale.reset();
  EXPECT_EQ(run.due(51, 0.02), Clock::time_point::min()) << "as fast as possible";
}

TEST(ActiveRun, EndsAtItsFrameOrAtRest) {
  EXPECT_FALSE(ActiveRun{}.reached(1'000'000, true));
  EXPECT_FALSE((ActiveRun{{}, 5, false, {}, 0}.reached(4, true)));
  EXPECT_TRUE((ActiveRun{{}, 5, false, {}, 0}.reached(5, false)));
  EXPECT_TRUE((ActiveRun{{}, {}, true, {}, 0}.reached(1, true)));
}

TEST(PublishAhead, TellsTheLogAboutOnceInTheInterval) {
  auto now = Clock::now();
  PublishAhead ahead(seconds(1), 0.02);
  ahead.note_used_up(now);
  EXPECT_EQ(ahead.frames(), 8);
  for (int i = 0; i < 20; ++i) ahead.note_used_up(now += milliseconds(100));
  EXPECT_EQ(ahead.frames(), 16'384) << "many frames a second";
  for (int i = 0; i < 20; ++i) ahead.note_used_up(now += seconds(5));
  EXPECT_EQ(ahead.frames(), 8) << "few";
  EXPECT_EQ(ahead.frames(1.0), 100) << "at a pace, those of two intervals";
}

TEST(Journal, HandsOverTheOutcomeOfAWriteOnce) {
  Journal journal(seconds(1), 0.02);
  EXPECT_FALSE(journal.waits());
  std::string outcome = "none";
  journal.begin([&](const std::string& error) { outcome = error; });
  EXPECT_TRUE(journal.waits());
  EXPECT_FALSE(journal.take());
  journal.end("disk full");
  const auto written = journal.take();
  ASSERT_TRUE(written);
  written->first(written->second);
  EXPECT_EQ(outcome, "disk full");
  EXPECT_FALSE(journal.waits());
  EXPECT_TRUE(journal.idle());
}

}  // namespace
}  // namespace weft

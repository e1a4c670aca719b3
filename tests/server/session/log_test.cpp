#include "server/session/log.h"

#include <gmock/gmock.h>

#include <thread>

#include "tests/server/session/session_support.h"

namespace weft::testing {
namespace {

using ::testing::SizeIs;

// A log in memory, which can be told to fail or to take its time.
struct Disk {
  std::mutex mutex;
  std::vector<LogEntry> entries;
  Reach reach;
  std::string error;  // of every write
  bool slow = false;
  std::vector<std::function<void()>> waiting;  // writes that take their time

  SessionPast past() {
    std::lock_guard lock(mutex);
    return {entries, reach};
  }
  void fail(const std::string& why) {
    std::lock_guard lock(mutex);
    error = why;
  }
  void finish() {  // waits for one
    std::function<void()> write;
    while (!write) {
      std::lock_guard lock(mutex);
      if (!waiting.empty()) {
        write = std::move(waiting.back());
        waiting.pop_back();
      }
    }
    write();
  }
};

class DiskLog : public SessionLog {
 public:
  explicit DiskLog(std::shared_ptr<Disk> disk) : disk_(std::move(disk)) {}

  void write(const std::optional<LogEntry>& entry, const Reach& reach,
             const Written& written) override {
    std::string error;
    {
      std::lock_guard lock(disk_->mutex);
      error = disk_->error;
      if (error.empty()) {
        if (entry) disk_->entries.push_back(*entry);
        disk_->reach = reach;
      }
      if (disk_->slow) {
        disk_->waiting.emplace_back([written, error] { written(error); });
        return;
      }
    }
    written(error);
  }

 private:
  std::shared_ptr<Disk> disk_;
};

class SessionLogTest : public ::testing::Test {
 protected:
  std::shared_ptr<Session> make(const std::shared_ptr<Disk>& disk) {
    return std::make_shared<Session>(make_identity("test", "test"), Simulation(hung_scene()),
                                     SessionHost{scheduler_, stats(), kMuchHistory},
                                     std::make_unique<DiskLog>(disk));
  }
  // The session that another process would have.
  std::shared_ptr<Session> restored(const SessionPast& past) {
    const auto session = make(std::make_shared<Disk>());
    session->restore(past);
    return session;
  }

  Scheduler scheduler_{2};
  std::shared_ptr<Disk> disk_ = std::make_shared<Disk>();
};

StepCommand named_step(std::int64_t frames, const std::string& id) {
  StepCommand command;
  command.frames = frames;
  command.request = {id, 1};
  return command;
}

SetTextile bend(double value) {
  SetTextile command;
  command.edit = [value](const Textile& current) {
    Textile edited = current;
    std::get<RawTextile>(edited.model).bend = value;
    return edited;
  };
  return command;
}

TEST_F(SessionLogTest, HasACallBeforeItIsCarriedOut) {
  disk_->slow = true;
  const auto session = make(disk_);
  Answer answer = run(*session, 3);
  while (disk_->past().log.empty()) std::this_thread::yield();
  EXPECT_FALSE(answer.is_there());
  EXPECT_EQ(session->status().state, SessionState::kPaused);
  disk_->finish();
  EXPECT_EQ(answer.applied().frame, 1);
}

TEST_F(SessionLogTest, ThatCannotBeWrittenRefusesCallsAndChangesNothing) {
  const auto session = make(disk_);
  step(*session, 2).applied();
  disk_->fail("the disk is full");
  Answer stepped = step(*session, 1);
  EXPECT_EQ(std::get<Refusal>(stepped.outcome()).text, "the disk is full");
  EXPECT_EQ(run(*session).refused(), Refusal::Why::kNotKept);
  EXPECT_EQ(pause(*session).refused(), Refusal::Why::kNotKept);
  EXPECT_EQ(Answer(*session, bend(2e-5)).refused(), Refusal::Why::kNotKept);
  EXPECT_EQ(session->status().newest->number, 2);
  EXPECT_EQ(session->status().state, SessionState::kPaused);
  disk_->fail("");
  EXPECT_EQ(step(*session, 1).applied().newest, 3);
}

TEST_F(SessionLogTest, ThatCannotBeWrittenDoesNotEndARun) {
  const auto session = make(disk_);
  const auto watcher = Watcher::of(*session, 0);
  run(*session).applied();
  disk_->fail("the disk is full");
  watcher->wait_for_frame(session->status().newest->number + 5'000);
}

TEST_F(SessionLogTest, SaysHowFarFramesGoBeforeTheyArePublished) {
  const auto session = make(disk_);
  const auto watcher = Watcher::of(*session, 0);
  run(*session, 3000).applied();
  for (int i = 0; i <= 3000; ++i) {
    const std::int64_t frame = watcher->read().frame->number;
    ASSERT_LE(frame, disk_->past().reach.frame);
  }
  EXPECT_EQ(disk_->past().reach.frame, 3000);
}

TEST_F(SessionLogTest, GivesTheSameFramesAgain) {
  const auto session = make(disk_);
  step(*session, 20).applied();
  Answer(*session, bend(3e-5)).applied();
  const auto watcher = Watcher::of(*session, 0);
  run(*session, 60).applied();
  watcher->wait_for_frame(30);
  Answer(*session, bend(4e-5)).applied();
  watcher->wait_for_frame(60);
  const auto again = restored(disk_->past());
  pause(*again).applied();
  const auto frame = session->status().newest, same = again->status().newest;
  ASSERT_EQ(same->number, frame->number);
  EXPECT_EQ(same->positions, frame->positions);
  EXPECT_EQ(same->velocities, frame->velocities);
}

// Frames that may have been seen come before any call.
TEST_F(SessionLogTest, LetsNoCallChangeAFrameThatMayHaveBeenPublished) {
  SessionPast past;
  past.log.push_back({0, {}, RunBegun{1e-3, std::nullopt, false}});
  past.reach.frame = 40;
  const auto session = restored(past);
  EXPECT_EQ(Answer(*session, bend(3e-5)).applied().frame, 41);
}

TEST_F(SessionLogTest, KnowsTheAnswersToNamedCalls) {
  const auto session = make(disk_);
  const Applied first = Answer(*session, named_step(5, "a")).applied();
  step(*session, 2).applied();
  const auto again = restored(disk_->past());
  const Applied same = Answer(*again, named_step(5, "a")).applied();
  EXPECT_EQ(same.frame, first.frame);
  EXPECT_EQ(same.newest, first.newest);
  EXPECT_EQ(same.time, first.time);
  EXPECT_EQ(again->status().newest->number, 7);
}

TEST_F(SessionLogTest, FinishesAStepThatHadBegun) {
  SessionPast past;
  past.log.push_back({0, {"a", 1}, StepsBegun{50}});
  past.reach.frame = 10;
  const auto session = restored(past);
  EXPECT_EQ(Answer(*session, named_step(50, "a")).applied().newest, 50);
}

TEST_F(SessionLogTest, EndsAStepWhoseCallerWentAway) {
  const auto session = make(disk_);
  const auto watcher = Watcher::of(*session, 0);
  std::stop_source caller;
  StepCommand command;
  command.frames = 100'000;
  command.cancelled = caller.get_token();
  Answer answer(*session, command);
  watcher->wait_for_frame(5);
  caller.request_stop();
  session->wake();
  EXPECT_EQ(answer.refused(), Refusal::Why::kCancelled);
  const std::int64_t newest = session->status().newest->number;
  ASSERT_THAT(disk_->past().log, SizeIs(2));
  const auto again = restored(disk_->past());
  EXPECT_EQ(step(*again, 1).applied().frame, newest + 1);
}

}  // namespace
}  // namespace weft::testing

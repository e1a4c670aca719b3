#include "server/session/log.h"

#include <gmock/gmock.h>

#include <atomic>
#include <map>
#include <thread>
#include <tuple>

#include "tests/server/session/session_support.h"

namespace weft::testing {
namespace {

using ::testing::SizeIs;

// A log in memory, which can be told to fail or to take its time.
struct Disk {
  std::mutex mutex;
  std::vector<LogEntry> entries;
  PublishLimit limit;
  std::string error;  // of every write
  bool slow = false;
  std::vector<std::function<void()>> waiting;  // writes that take their time
  std::vector<std::shared_ptr<const SessionSnapshot>> snapshots;
  std::map<std::string, std::shared_ptr<const SessionSnapshot>> named;
  std::atomic<int> offers = 0;  // of snapshots
  std::function<void()> before_snapshot;

  SavedSession saved() {
    std::lock_guard lock(mutex);
    SavedSession saved{entries, limit};
    for (const auto& snapshot : snapshots) {
      if (!limit.history_from || snapshot->simulation.frame <= *limit.history_from)
        saved.snapshot = *snapshot;
    }
    return saved;
  }
  void fail(const std::string& why) {
    std::lock_guard lock(mutex);
    error = why;
  }
  std::int64_t begun() {  // waits for a write; how far frames may go once it has finished
    for (;;) {
      std::lock_guard lock(mutex);
      if (!waiting.empty()) return limit.frame;
    }
  }
  void hurry() {
    {
      std::lock_guard lock(mutex);
      slow = false;
      if (waiting.empty()) return;
    }
    finish();
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

  void write(const std::optional<LogEntry>& entry, const PublishLimit& limit,
             const Written& written) override {
    std::string error;
    {
      std::lock_guard lock(disk_->mutex);
      error = disk_->error;
      if (error.empty()) {
        if (entry) disk_->entries.push_back(*entry);
        disk_->limit = limit;
      }
      if (disk_->slow) {
        disk_->waiting.emplace_back([written, error] { written(error); });
        return;
      }
    }
    written(error);
  }

  bool offer(const Take& take, std::int64_t /*oldest*/) override {
    if (disk_->before_snapshot) disk_->before_snapshot();
    const auto snapshot = take();
    std::lock_guard lock(disk_->mutex);
    if (snapshot) disk_->snapshots.push_back(snapshot);
    ++disk_->offers;
    return snapshot != nullptr;
  }

  void keep(const std::string& id, std::shared_ptr<const SessionSnapshot> snapshot,
            const Kept& kept) override {
    std::string error;
    {
      std::lock_guard lock(disk_->mutex);
      error = disk_->error;
      if (error.empty()) disk_->named[id] = snapshot;
    }
    NamedSnapshot named;
    named.id = id;
    named.frame = snapshot->simulation.frame;
    kept(error, named);
  }
  void drop(const std::string& id) override {
    std::lock_guard lock(disk_->mutex);
    disk_->named.erase(id);
  }

 private:
  std::shared_ptr<Disk> disk_;
};

class SessionLogTest : public ::testing::Test {
 protected:
  SessionHost host(std::size_t history_bytes = kMuchHistory) {
    return {scheduler_, stats(), history_for(history_bytes)};
  }
  static std::shared_ptr<Session> make(const std::shared_ptr<Disk>& disk, const SessionHost& host) {
    return std::make_shared<Session>(make_identity("test", "test"), Simulation(hung_scene()), host,
                                     std::make_unique<DiskLog>(disk));
  }
  std::shared_ptr<Session> make(const std::shared_ptr<Disk>& disk) { return make(disk, host()); }
  // One that takes a snapshot of every frame.
  std::shared_ptr<Session> make_kept(const std::shared_ptr<Disk>& disk,
                                     std::size_t history_bytes = kMuchHistory) {
    SessionHost often = host(history_bytes);
    often.snapshot_after = {};
    return make(disk, often);
  }
  // The session that another process would have.
  std::shared_ptr<Session> restored(const SavedSession& saved) {
    const auto session = make(std::make_shared<Disk>());
    EXPECT_TRUE(session->restore(saved));
    return session;
  }
  std::shared_ptr<Session> restored_and_paused(const SavedSession& saved) {
    const auto session = restored(saved);
    pause(*session).applied();
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
  while (disk_->saved().log.empty()) std::this_thread::yield();
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
    ASSERT_LE(frame, disk_->saved().limit.frame);
  }
  EXPECT_EQ(disk_->saved().limit.frame, 3000);
}

TEST_F(SessionLogTest, SaysOfARunAtAPaceNoMoreThanThatHoweverFastTheSessionWas) {
  const auto session = make(disk_);
  const auto watcher = Watcher::of(*session, 0);
  run(*session, 3000).applied();
  while (watcher->read().frame->number < 3000) {
  }
  RunCommand command;
  command.time_scale = 1e-3;  // a frame in 17 s
  Answer(*session, command).applied();
  EXPECT_LE(disk_->saved().limit.frame, 3008);
}

TEST_F(SessionLogTest, StandsStillWhereTheDiskDoesNotYetSayHowFarFramesGo) {
  const auto session = make(disk_), other = make(std::make_shared<Disk>());
  disk_->slow = true;
  auto running = run(*session, 3000);
  const std::int64_t limit = disk_->begun();
  ASSERT_LT(limit, 3000);
  disk_->finish();
  running.applied();
  step(*other, 1000).applied();  // takes its time
  EXPECT_LE(session->status().newest->number, limit);
  disk_->hurry();
  const auto watcher = Watcher::of(*session, 0);
  while (watcher->read().frame->number < 3000) {
  }
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
  const auto again = restored_and_paused(disk_->saved());
  const auto frame = session->status().newest, same = again->status().newest;
  ASSERT_EQ(same->number, frame->number);
  EXPECT_EQ(same->positions, frame->positions);
  EXPECT_EQ(same->velocities, frame->velocities);
}

// Frames that may have been seen come before any call.
TEST_F(SessionLogTest, LetsNoCallChangeAFrameThatMayHaveBeenPublished) {
  SavedSession saved;
  saved.log.push_back({0, {}, RunBegun{1e-3, std::nullopt, false}});
  saved.limit.frame = 40;
  const auto session = restored(saved);
  EXPECT_EQ(Answer(*session, bend(3e-5)).applied().frame, 41);
}

TEST_F(SessionLogTest, KnowsTheAnswersToNamedCalls) {
  const auto session = make(disk_);
  const Applied first = Answer(*session, named_step(5, "a")).applied();
  step(*session, 2).applied();
  const auto again = restored(disk_->saved());
  const Applied same = Answer(*again, named_step(5, "a")).applied();
  EXPECT_EQ(same.frame, first.frame);
  EXPECT_EQ(same.newest, first.newest);
  EXPECT_EQ(same.time, first.time);
  EXPECT_EQ(again->status().newest->number, 7);
}

TEST_F(SessionLogTest, FinishesAStepThatHadBegun) {
  SavedSession saved;
  saved.log.push_back({0, {"a", 1}, StepsBegun{50}});
  saved.limit.frame = 10;
  const auto session = restored(saved);
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
  ASSERT_THAT(disk_->saved().log, SizeIs(2));
  const auto again = restored(disk_->saved());
  EXPECT_EQ(step(*again, 1).applied().frame, newest + 1);
}

// Frames that were computed while it did something.
template <class F>
std::int64_t computed_by(const F& something) {
  const std::int64_t before = stats().frames;
  something();
  return stats().frames - before;
}

void expect_equal(const Session& found, const Session& wanted) {
  const SessionStatus a = found.status(), b = wanted.status();
  ASSERT_EQ(a.newest->number, b.newest->number);
  EXPECT_EQ(a.newest->positions, b.newest->positions);
  EXPECT_EQ(a.newest->velocities, b.newest->velocities);
  EXPECT_EQ(a.newest->time, b.newest->time);
  EXPECT_EQ(deformation_of(*a.newest).potential_energy, deformation_of(*b.newest).potential_energy);
  EXPECT_EQ(a.newest->substeps, b.newest->substeps);
  EXPECT_EQ(a.textiles, b.textiles);
  EXPECT_EQ(a.plan->step.estimated_bound, b.plan->step.estimated_bound);
  EXPECT_EQ(a.plan->step.unsheared_bound, b.plan->step.unsheared_bound);
  EXPECT_EQ(a.plan->step.slow_every, b.plan->step.slow_every);
}

TEST_F(SessionLogTest, WithASnapshotComputesOnlyWhatCameAfterIt) {
  const auto session = make_kept(disk_);
  step(*session, 200).applied();
  Answer(*session, bend(3e-5)).applied();
  step(*session, 100).applied();
  Answer(*session, bend(4e-5)).applied();
  const SavedSession saved = disk_->saved();
  ASSERT_TRUE(saved.snapshot);
  std::shared_ptr<Session> again;
  EXPECT_EQ(computed_by([&] { again = restored_and_paused(saved); }), 0);
  for (int i = 0; i < 20; ++i) {
    expect_equal(*again, *session);
    step(*again, 1).applied();
    step(*session, 1).applied();
  }
}

// Whenever it was taken: in a step, in a run, before a change, after a pause.
TEST_F(SessionLogTest, GivesTheSameFramesAndAnswersFromEverySnapshot) {
  const auto session = make_kept(disk_);
  const Applied stepped = Answer(*session, named_step(10, "step")).applied();
  SetTextile change = bend(3e-5);
  change.request = {"change", 7};
  const Applied changed = Answer(*session, change).applied();
  const auto watcher = Watcher::of(*session, 0);
  run(*session, 1'000'000).applied();
  watcher->wait_for_frame(20);
  pause(*session).applied();
  RunCommand to_goal;
  to_goal.until_frame = session->status().newest->number + 10;
  to_goal.request = {"run", 8};
  const Applied ran = Answer(*session, to_goal).applied();
  watcher->wait_for_frame(*to_goal.until_frame);
  pause(*session).applied();
  const auto frames = session->status().newest->number;
  SavedSession saved = disk_->saved();
  ASSERT_EQ(static_cast<std::int64_t>(disk_->snapshots.size()), frames);
  for (const auto& snapshot : disk_->snapshots) {
    SCOPED_TRACE(snapshot->simulation.frame);
    saved.snapshot = *snapshot;
    std::shared_ptr<Session> again;
    EXPECT_EQ(computed_by([&] { again = restored_and_paused(saved); }),
              frames - snapshot->simulation.frame);
    expect_equal(*again, *session);
    EXPECT_EQ(Answer(*again, named_step(10, "step")).applied().time, stepped.time);
    const Applied same = Answer(*again, change).applied();
    EXPECT_EQ(same.frame, changed.frame);
    EXPECT_EQ(same.textile, changed.textile);
    EXPECT_EQ(same.plan->step.estimated_bound, changed.plan->step.estimated_bound);
    EXPECT_EQ(Answer(*again, to_goal).applied().frame, ran.frame);
  }
}

TEST_F(SessionLogTest, TakesASnapshotAfterManyCalls) {
  const auto session = make(disk_);
  for (int i = 0; i < 499; ++i) pause(*session).applied();
  EXPECT_EQ(disk_->offers, 0);
  pause(*session).applied();
  pause(*session).applied();  // after it
  ASSERT_EQ(disk_->offers, 1);
  EXPECT_EQ(disk_->saved().snapshot->entries, 500);
}

TEST_F(SessionLogTest, SaysThatThereIsASnapshotOnceThatIsWritten) {
  const auto session = make(disk_);
  step(*session, 3).applied();
  disk_->fail("the disk is full");
  EXPECT_EQ(Answer(*session, KeepSnapshot{"a", {}, {}}).refused(), Refusal::Why::kNotKept);
  EXPECT_THAT(session->snapshots(), SizeIs(0));
  disk_->fail("");
  EXPECT_EQ(Answer(*session, KeepSnapshot{"a", {"name", 1}, {}}).applied().newest, 3);
  const SavedSession saved = disk_->saved();
  ASSERT_THAT(saved.log, SizeIs(2));
  EXPECT_EQ(std::get<SnapshotKept>(saved.log.back().event).id, "a");
  EXPECT_EQ(disk_->named.at("a")->entries, 1);
  ASSERT_THAT(session->snapshots(), SizeIs(1));
  EXPECT_EQ(session->snapshots().front().frame, 3);
  // a restart knows the answer, and takes none again
  const auto again = restored(saved);
  EXPECT_EQ(Answer(*again, KeepSnapshot{"a", {"name", 1}, {}}).applied().newest, 3);
}

TEST_F(SessionLogTest, NeedsASnapshotWhereItsBeginningWasForgotten) {
  const auto session = make_kept(disk_);
  step(*session, 20).applied();
  Answer(*session, bend(3e-5)).applied();
  step(*session, 10).applied();
  SavedSession saved = disk_->saved();
  saved.log.erase(saved.log.begin(), saved.log.begin() + 2);
  saved.first = 2;
  expect_equal(*restored_and_paused(saved), *session);
  saved.snapshot->entries = 1;
  EXPECT_FALSE(make(std::make_shared<Disk>())->restore(saved));
  saved.snapshot.reset();
  EXPECT_FALSE(make(std::make_shared<Disk>())->restore(saved));
}

TEST_F(SessionLogTest, WithASnapshotGivesReadersTheFramesThatTheyHad) {
  const auto session = make_kept(disk_, history_of(20));
  const auto watcher = Watcher::of(*session, 0);
  run(*session, 300).applied();
  watcher->wait_for_frame(300);
  pause(*session).applied();
  const std::int64_t oldest = watcher->subscription().progress().oldest_frame;
  ASSERT_GT(oldest, 200);
  const auto again = restored(disk_->saved());
  const auto reader = Watcher::of(*again, oldest);
  for (std::int64_t frame = oldest; frame <= 300; ++frame) {
    ASSERT_EQ(reader->read().frame->number, frame);
  }
}

// A restart computes frames again from where this says.
TEST_F(SessionLogTest, SaysWhatReadersMayWantAgainAndNoMore) {
  SessionHost at_once = host();
  at_once.return_time = {};
  const auto patient = std::make_shared<Disk>();
  for (const auto& [session, disk, read, wanted] :
       {std::tuple{make(disk_, at_once), disk_, 300, 100},
        std::tuple{make(patient), patient, 0, 0}}) {
    const auto reader = Watcher::of(*session, 0);
    step(*session, 300).applied();
    while (reader->read().frame->number < 300) {
    }
    step(*session, 1).applied();
    EXPECT_EQ(disk->saved().limit.history_from, read);
    const auto slow = Watcher::of(*session, 100);
    step(*session, 1).applied();
    EXPECT_EQ(disk->saved().limit.history_from, wanted);
  }
}

TEST_F(SessionLogTest, KnowsWhatReadersHadOnceAllOfThemAreBack) {
  const auto session = make(disk_);
  const auto one = Watcher::of(*session, 0), two = Watcher::of(*session, 0);
  step(*session, 300).applied();
  while (disk_->saved().limit.readers < 2) std::this_thread::yield();
  const auto disk = std::make_shared<Disk>();
  const auto again = make(disk);
  ASSERT_TRUE(again->restore(disk_->saved()));
  const auto back = Watcher::of(*again, 290);
  step(*again, 1).applied();
  EXPECT_EQ(disk->saved().limit.history_from, 0);
  const auto later = Watcher::of(*again, 250);
  step(*again, 1).applied();
  EXPECT_EQ(disk->saved().limit.history_from, 250);
}

TEST_F(SessionLogTest, ForgetsWhereReadersWereWhenTheyAreGone) {
  const auto session = make_kept(disk_);
  auto watcher = Watcher::of(*session, 0);
  step(*session, 30).applied();
  EXPECT_EQ(disk_->saved().limit.history_from, 0);
  watcher->leave();
  while (disk_->saved().limit.history_from) std::this_thread::yield();
  EXPECT_EQ(disk_->saved().snapshot->simulation.frame, 30);
}

// What a drain ends goes on after a restart.
TEST_F(SessionLogTest, HasNoSnapshotOfASessionThatIsClosed) {
  const auto session = make_kept(disk_);
  disk_->before_snapshot = [&] { session->close(Refusal::Why::kDraining); };
  run(*session).applied();
  while (disk_->offers == 0) std::this_thread::yield();
  EXPECT_FALSE(disk_->saved().snapshot);
}

TEST_F(SessionLogTest, WithASnapshotThatDoesNotFitComputesEverythingAgain) {
  const auto session = make_kept(disk_);
  step(*session, 30).applied();
  SavedSession saved = disk_->saved();
  for (const int fault : {0, 1, 2}) {
    SavedSession wrong = saved;
    if (fault == 0) wrong.snapshot->simulation.sheets[0].solver.pop_back();
    if (fault == 1) wrong.snapshot->entries = 5;
    if (fault == 2) wrong.snapshot->entries = 0;
    std::shared_ptr<Session> again;
    EXPECT_EQ(computed_by([&] { again = restored_and_paused(wrong); }), 30);
    expect_equal(*again, *session);
  }
}

}  // namespace
}  // namespace weft::testing

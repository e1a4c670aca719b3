#include <gmock/gmock.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "server/store/snapshot_files.h"
#include "server/store/snapshots.h"
#include "server/store/store.h"
#include "tests/server/restart_support.h"

namespace weft::testing {
namespace {

using ::testing::SizeIs;
using Sessions = Service::Sessions;

TEST_F(RestartWithSnapshots, ComputesOnlyWhatCameAfterTheLast) {
  const v1::Session session = service_->create();
  service_->step(session, 300);
  const std::int64_t last = kept(session);
  set_preset(session, "denim_11oz");
  const v1::Session before = service_->get(session);
  restart();
  service_->pause(session);
  EXPECT_EQ(computed(), 0);
  EXPECT_EQ(service_->get(session).SerializeAsString(), before.SerializeAsString());
  service_->step(session, 5);
  const auto found = Stream(*service_, frames_of(session, last, last + 5)).rest();

  const v1::Session undisturbed = service_->create();
  service_->step(undisturbed, last);
  set_preset(undisturbed, "denim_11oz");
  service_->step(undisturbed, 5);
  const auto wanted = Stream(*service_, frames_of(undisturbed, last, last + 5)).rest();
  expect_equal(found, wanted);
}

TEST_F(RestartWithSnapshots, KeepsSomeOfThemAndNoneOfASessionThatIsGone) {
  const v1::Session session = service_->create(), other = service_->create();
  for (int i = 0; i < 10; ++i) kept(session);
  kept(other);
  while (files_of(session).size() != weft::Snapshots::kMost) std::this_thread::yield();
  service_->erase(other);
  while (std::filesystem::exists(snapshots_of(other))) std::this_thread::yield();
}

// Whatever byte is changed, wherever the file ends: the one before it serves.
TEST_F(RestartWithSnapshots, NeverMistakesADamagedOneForASound) {
  const v1::Session session = service_->create();
  kept(session);
  const std::int64_t newest = kept(session);
  const std::string before = service_->get(session).SerializeAsString();
  service_.reset();
  const auto kept_files = files_of(session);
  const auto& file = kept_files.back();
  const std::int64_t older = frame_of(kept_files[kept_files.size() - 2]);
  ASSERT_LT(older, newest);
  const std::string good = content(file);
  spdlog::set_level(spdlog::level::off);
  const weft::Snapshots files(std::make_unique<SnapshotFiles>(directory_.path("snapshots")));
  const auto frame_with = [&](const std::string& bytes) {
    std::ofstream(file, std::ios::binary) << bytes;
    return files.read(session.uid(), std::nullopt, 0)->simulation.frame;
  };
  EXPECT_EQ(frame_with(good), newest);
  for (std::size_t place = 0; place < good.size(); place += 3) {
    std::string bytes = good;
    bytes[place] = static_cast<char>(bytes[place] ^ 0x11);
    ASSERT_EQ(frame_with(bytes), older) << "byte " << place;
  }
  for (std::size_t size = 0; size < good.size(); size += 7)
    ASSERT_EQ(frame_with(good.substr(0, size)), older) << size << " bytes";
  spdlog::set_level(spdlog::level::info);

  std::ofstream(file, std::ios::binary) << good.substr(0, 100);
  start();
  service_->pause(session);
  EXPECT_EQ(computed(), newest - older);
  EXPECT_EQ(service_->get(session).SerializeAsString(), before);
}

TEST_F(RestartWithSnapshots, ComputesAllThatTheLogSaysWhereTheyAreDamaged) {
  const v1::Session session = service_->create();
  kept(session);
  const std::int64_t newest = kept(session);
  const std::string before = service_->get(session).SerializeAsString();
  service_.reset();
  for (const auto& each : files_of(session)) std::ofstream(each, std::ios::binary) << "damaged";
  start();
  service_->pause(session);
  EXPECT_EQ(computed(), newest);
  EXPECT_EQ(service_->get(session).SerializeAsString(), before);
}

// A server that keeps few frames, so that little of a session has to be computed again.
class RestartWithLongLogs : public RestartWithSnapshots {
 protected:
  RestartWithLongLogs() {
    history_bytes_ = 20'000;  // some 12 frames
    restart();
  }

  // The log of the only session, when its server is gone.
  SavedSession saved() {
    service_.reset();
    auto left = open_sqlite_store(directory_.name())->load();
    EXPECT_THAT(left.sessions, SizeIs(1));
    return std::move(left.sessions.at(0).saved);
  }
  // Adds 1200 entries to the log.
  void change_and_step(const v1::Session& session) {
    v1::UpdateTextileRequest request;
    request.set_name(session.name());
    request.mutable_update_mask()->add_paths("raw.bend_n_m2");
    for (int i = 0; i < 600; ++i) {
      request.mutable_textile()->mutable_raw()->set_bend_n_m2(1e-6 * (1 + i % 7));
      ASSERT_EQ(service_->error(&Sessions::UpdateTextile, request).code, grpc::StatusCode::OK);
      service_->step(session);
    }
  }
  std::string newest(const v1::Session& session) {
    const std::int64_t frame = service_->get(session).frame();
    return Stream(*service_, frames_of(session, frame, frame)).rest().at(0).SerializeAsString();
  }
};

TEST_F(RestartWithLongLogs, ForgetsWhatLiesBeforeTheOlderSnapshotsButNoAnswer) {
  const v1::Session session = service_->create();
  v1::StepSessionRequest named;
  named.set_name(session.name());
  named.set_request_id("first");
  v1::StepSessionResponse first, again;
  ASSERT_TRUE(service_->call(&Sessions::StepSession, named, &first).ok());
  change_and_step(session);
  kept(session);
  const std::string before = newest(session);
  const SavedSession left = saved();
  EXPECT_GT(left.first, 0);
  EXPECT_LT(left.log.size(), 400);
  EXPECT_GT(left.first + static_cast<std::int64_t>(left.log.size()), 1200);

  start();
  service_->pause(session);
  EXPECT_LT(computed(), 100);
  EXPECT_EQ(newest(session), before);
  ASSERT_TRUE(service_->call(&Sessions::StepSession, named, &again).ok());
  EXPECT_EQ(again.SerializeAsString(), first.SerializeAsString());

  // the newest is damaged: the log reaches back to the one before
  service_.reset();
  std::ofstream(files_of(session).back(), std::ios::binary) << "damaged";
  start();
  service_->pause(session);
  EXPECT_EQ(newest(session), before);
  service_.reset();
  for (const auto& file : files_of(session)) std::ofstream(file, std::ios::binary) << "damaged";
  start();
  v1::GetSessionRequest get;
  get.set_name(session.name());
  EXPECT_EQ(service_->error(&Sessions::GetSession, get).reason(), "SESSION_DAMAGED");
}

TEST_F(RestartWithLongLogs, GivesTheFramesOfAServerThatWasLeftAlone) {
  const v1::Session session = service_->create();
  change_and_step(session);
  restart();
  change_and_step(session);
  const std::string after = newest(session);
  EXPECT_GT(saved().first, 1000);
  start();
  service_->erase(session);
  history_bytes_ = 64 << 20;
  snapshot_ms_ = 3'600'000;
  restart();
  const v1::Session undisturbed = service_->create();
  change_and_step(undisturbed);
  change_and_step(undisturbed);
  EXPECT_EQ(newest(undisturbed), after);
}

TEST_F(RestartWithLongLogs, ForgetsCallsOfASessionThatStandsStill) {
  const v1::Session session = service_->create();
  for (int i = 0; i < 2100; ++i) service_->pause(session);
  set_preset(session, "denim_11oz");
  const std::string before = service_->get(session).SerializeAsString();
  const SavedSession left = saved();
  EXPECT_LE(left.log.size(), 1100);
  EXPECT_EQ(left.first + static_cast<std::int64_t>(left.log.size()), 2101);
  start();
  service_->pause(session);
  EXPECT_EQ(service_->get(session).SerializeAsString(), before);
}

TEST_F(RestartWithSnapshots, GoesOnWhereTheyCannotBeWritten) {
  service_.reset();
  std::filesystem::remove_all(directory_.path("snapshots"));
  std::ofstream(directory_.path("snapshots")) << "no directory";
  start();
  const v1::Session session = service_->create();
  service_->step(session, 30);
  const std::string before = service_->get(session).SerializeAsString();
  restart();
  service_->pause(session);
  EXPECT_EQ(service_->get(session).SerializeAsString(), before);
}

TEST(Snapshots, AreKeptWhereARestartNeedsThem) {
  std::vector<SnapshotPlace> kept;
  const auto discard = [&](std::int64_t oldest) {
    for (const SnapshotPlace& gone : superfluous(kept, oldest)) std::erase(kept, gone);
  };
  for (std::int64_t frame = 10; frame <= 1000; frame += 10) {
    kept.push_back({frame, 1});
    const std::int64_t oldest = std::max<std::int64_t>(0, frame - 300);
    discard(oldest);
    EXPECT_LE(kept.size(), weft::Snapshots::kMost);
    EXPECT_EQ(kept.back().frame, frame);
    if (frame == 10) continue;
    EXPECT_EQ(kept[kept.size() - 2].frame, frame - 10);
    EXPECT_LE(kept[1].frame, std::max<std::int64_t>(oldest, 20));
    EXPECT_GE(kept[0].frame, oldest - 400);
  }
  discard(1000);
  EXPECT_EQ(kept, (std::vector<SnapshotPlace>{{990, 1}, {1000, 1}}));
}

}  // namespace
}  // namespace weft::testing

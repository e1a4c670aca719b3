#include "server/store/store.h"

#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "server/store/snapshot_files.h"
#include "server/store/snapshots.h"
#include "tests/support/service/service.h"
#include "tests/support/temporary_directory.h"

namespace weft::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;
using Sessions = Service::Sessions;

// A directory with sessions in it, and servers that take them over from each other.
class Restart : public ::testing::Test {
 protected:
  Restart() { start(); }

  void start() {
    ServerOptions options = Service::in_process();
    options.data_dir = directory_.name();
    options.snapshot_ms = snapshot_ms_;
    options.limits.history_bytes_per_session = history_bytes_;
    options.idle = idle_;
    service_ = std::make_unique<Service>(options);
  }
  void restart() {
    service_.reset();
    start();
  }

  // All frames up to the one given, which there may have to be waited for.
  std::vector<v1::Frame> frames(const v1::Session& session, std::int64_t last) {
    return Stream(*service_, frames_of(session, 0, last)).rest();
  }
  static void expect_equal(const std::vector<v1::Frame>& found,
                           const std::vector<v1::Frame>& wanted) {
    ASSERT_EQ(found.size(), wanted.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      ASSERT_EQ(found[i].SerializeAsString(), wanted[i].SerializeAsString()) << "frame " << i;
    }
  }

  void set_preset(const v1::Session& session, const std::string& preset) {
    v1::UpdateTextileRequest request;
    request.set_name(session.name());
    request.mutable_textile()->set_preset(preset);
    ASSERT_EQ(service_->error(&Sessions::UpdateTextile, request).code, grpc::StatusCode::OK);
  }

  std::string file() const { return directory_.path("sessions.db"); }

  // Frames that this server has computed, restored ones among them.
  std::int64_t computed() {
    grpc::ClientContext context;
    v1::ServerStats stats;
    EXPECT_TRUE(service_->servers->GetServerStats(&context, {}, &stats).ok());
    return stats.frames();
  }
  void wait_until_held() {
    for (std::int64_t before = -1, now; (now = computed()) != before; before = now)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  const TemporaryDirectory directory_;
  int snapshot_ms_ = 2000;
  std::chrono::milliseconds idle_{0};
  std::int64_t history_bytes_ = 64 << 20;
  std::unique_ptr<Service> service_;
};

TEST_F(Restart, HasEverySessionWhereItWasWithTheSameFrames) {
  v1::Scene windy = small_scene();
  windy.mutable_environment()->mutable_wind()->mutable_velocity_m_per_s()->set_x(3);
  windy.mutable_sheets(0)->mutable_placement()->mutable_rotation()->set_w(0.6);
  windy.mutable_sheets(0)->mutable_placement()->mutable_rotation()->set_x(0.8);
  for (const auto& scene : {small_scene(), windy}) {
    const v1::Session session = service_->create(scene);
    service_->step(session, 10);
    set_preset(session, "denim_11oz");
    service_->step(session, 5);
    set_preset(session, "wool_tropical");
    service_->run(session, 40);
    const auto before = frames(session, 40);
    const v1::Session shown = service_->get(session);
    restart();
    expect_equal(frames(session, 40), before);
    service_->step(session, 1);
    service_->erase(session);
    EXPECT_EQ(shown.uid(), session.uid());
  }
}

TEST_F(Restart, KeepsASessionThatNobodyUsesInTheStoreAloneUntilItIsNamed) {
  const auto wait_for = [&](std::int64_t sessions) {
    while (service_->info().sessions() != sessions) std::this_thread::yield();
  };
  idle_ = std::chrono::milliseconds(100);
  restart();
  const v1::Session session = service_->create(small_scene(), "curtain");
  service_->step(session, 12);
  const auto before = frames(session, 12);
  wait_for(0);
  v1::ListSessionsResponse listed;
  ASSERT_TRUE(service_->call(&Sessions::ListSessions, {}, &listed).ok());
  ASSERT_THAT(listed.sessions(), SizeIs(1));
  EXPECT_EQ(listed.sessions(0).uid(), session.uid());
  EXPECT_EQ(listed.sessions(0).state(), v1::SESSION_STATE_STORED);
  EXPECT_EQ(service_->create_error(small_scene(), "curtain").code,
            grpc::StatusCode::ALREADY_EXISTS);
  expect_equal(frames(session, 12), before);
  service_->step(session, 1);
  EXPECT_EQ(service_->get(session).frame(), 13);
  wait_for(0);
  restart();
  EXPECT_EQ(service_->get(session).uid(), session.uid());
  wait_for(0);
  service_->erase(session);
  v1::GetSessionRequest request;
  request.set_name(session.name());
  EXPECT_EQ(service_->error(&Sessions::GetSession, request).code, grpc::StatusCode::NOT_FOUND);
}

TEST_F(Restart, LeavesNoSessionToTheStoreThatRunsOrIsWatched) {
  idle_ = std::chrono::milliseconds(50);
  restart();
  const v1::Session running = service_->create(), watched = service_->create();
  Stream stream(*service_, frames_of(watched));
  stream.frame();
  v1::RunSessionRequest request;
  request.set_name(running.name());
  request.set_time_scale(1);
  ASSERT_EQ(service_->error(&Sessions::RunSession, request).code, grpc::StatusCode::OK);
  service_->create();
  while (service_->info().sessions() > 2) std::this_thread::yield();
  std::this_thread::sleep_for(4 * idle_);
  EXPECT_EQ(service_->info().sessions(), 2);
}

TEST_F(Restart, GoesOnWithATextileThatIsChanging) {
  for (const int snapshot_ms : {2000, 0}) {  // by the log; by snapshots
    snapshot_ms_ = snapshot_ms;
    restart();
    const v1::Session session = service_->create();
    v1::UpdateTextileRequest request;
    request.set_name(session.name());
    request.mutable_textile()->mutable_raw()->set_stretch_n_per_m(40);
    request.mutable_update_mask()->add_paths("raw.stretch_n_per_m");
    request.set_duration_s(0.5);
    ASSERT_EQ(service_->error(&Sessions::UpdateTextile, request).code, grpc::StatusCode::OK);
    service_->step(session, 10);
    restart();
    service_->step(session, 5);

    const v1::Session undisturbed = service_->create();
    request.set_name(undisturbed.name());
    ASSERT_EQ(service_->error(&Sessions::UpdateTextile, request).code, grpc::StatusCode::OK);
    service_->step(undisturbed, 15);
    const auto textile = [&](const v1::Session& of) {
      return service_->get(of).scene().sheets(0).textile().SerializeAsString();
    };
    EXPECT_EQ(textile(session), textile(undisturbed));
    service_->step(session, 25);
    service_->step(undisturbed, 25);
    EXPECT_EQ(textile(session), textile(undisturbed));
    const auto newest = [&](const v1::Session& of) {
      return Stream(*service_, frames_of(of, 40, 40)).rest().at(0).positions_m();
    };
    EXPECT_EQ(newest(session), newest(undisturbed));
  }
}

TEST_F(Restart, RepeatsActionsAndLetsGoOfWhatStreamsHeld) {
  const v1::Session session = service_->create();
  service_->step(session, 4);
  v1::ApplyActionsRequest request;
  request.set_name(session.name());
  request.add_actions()->mutable_grab()->set_particle(13);
  v1::Drag* drag = request.add_actions()->mutable_drag();
  drag->set_particle(13);
  drag->mutable_target_m()->set_x(0.3);
  drag->set_duration_s(0.2);
  request.add_actions()->mutable_unpin()->set_particle(0);
  ASSERT_EQ(service_->error(&Sessions::ApplyActions, request).code, grpc::StatusCode::OK);
  service_->step(session, 5);
  grpc::ClientContext context;
  const auto stream = service_->sessions->Interact(&context);
  v1::InteractRequest message;
  message.set_session(session.name());
  message.set_sequence(1);
  message.mutable_action()->mutable_grab()->set_particle(7);
  v1::InteractResponse answer;
  ASSERT_TRUE(stream->Write(message) && stream->Read(&answer));
  service_->step(session, 5);
  const auto before = frames(session, 14);
  restart();
  expect_equal(frames(session, 14), before);
  service_->step(session, 1);
  request.clear_actions();
  request.add_actions()->mutable_grab()->set_particle(13);
  EXPECT_EQ(service_->error(&Sessions::ApplyActions, request).reason(), "FIELD_INVALID");
  request.mutable_actions(0)->mutable_grab()->set_particle(7);
  EXPECT_EQ(service_->error(&Sessions::ApplyActions, request).code, grpc::StatusCode::OK);
  const auto after = frames(session, 15);
  restart();
  expect_equal(frames(session, 15), after);
}

TEST_F(Restart, ShowsSessionsAsTheyWere) {
  const v1::Session session = service_->create(small_scene(), "curtain");
  service_->step(session, 7);
  set_preset(session, "denim_11oz");
  const v1::Session before = service_->get(session);
  restart();
  service_->pause(session);  // waits until it is restored
  EXPECT_EQ(service_->get(session).SerializeAsString(), before.SerializeAsString());
}

TEST_F(Restart, FindsDeletedSessionsDeleted) {
  const v1::Session session = service_->create(small_scene(), "curtain");
  service_->step(session, 3);
  service_->erase(session);
  restart();
  EXPECT_EQ(service_->info().sessions(), 0);
  EXPECT_EQ(service_->get(service_->create(small_scene(), "curtain")).frame(), 0);
}

TEST_F(Restart, LetsARunGoOnAndAPauseLast) {
  const v1::Session running = service_->create(), paused = service_->create();
  service_->run(running, 1'000'000'000);
  service_->run(paused, 1'000'000'000);
  Stream(*service_, frames_of(running, 0, 50)).rest();
  const std::int64_t at = service_->pause(paused).applied_frame() - 1;
  restart();
  Stream(*service_, frames_of(running, 0, 100)).rest();
  EXPECT_EQ(service_->pause(paused).applied_frame() - 1, at);
}

TEST_F(Restart, FinishesAStepAndAnswersItsCallerOnce) {
  const v1::Session session = service_->create();
  v1::StepSessionRequest request;
  request.set_name(session.name());
  request.set_frames(3000);
  request.set_request_id("step");
  std::jthread([&] {
    EXPECT_EQ(service_->error(&Sessions::StepSession, request).reason(), "SERVER_DRAINING");
  }).detach();
  Stream(*service_, frames_of(session, 0, 5)).rest();
  service_->server.stop();
  restart();
  v1::StepSessionResponse response;
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(service_->call(&Sessions::StepSession, request, &response).ok());
    EXPECT_EQ(response.applied_frame(), 1);
    EXPECT_EQ(response.frame(), 3000);
  }
}

TEST_F(Restart, RemembersNamedCreationsAndDeletions) {
  v1::CreateSessionRequest create;
  *create.mutable_session()->mutable_scene() = small_scene();
  create.set_request_id("create");
  v1::Session first, again;
  ASSERT_TRUE(service_->call(&Sessions::CreateSession, create, &first).ok());
  restart();
  ASSERT_TRUE(service_->call(&Sessions::CreateSession, create, &again).ok());
  EXPECT_EQ(again.uid(), first.uid());
  v1::DeleteSessionRequest erase;
  erase.set_name(first.name());
  erase.set_request_id("delete");
  EXPECT_EQ(service_->error(&Sessions::DeleteSession, erase).code, grpc::StatusCode::OK);
  restart();
  EXPECT_EQ(service_->error(&Sessions::DeleteSession, erase).code, grpc::StatusCode::OK);
  EXPECT_EQ(service_->info().sessions(), 0);
}

TEST_F(Restart, KeepsAFailedSessionFailed) {
  const v1::Session session = service_->create(diverging_scene());
  service_->run(session, 1000);
  Stream(*service_, frames_of(session)).finish();
  const v1::Session before = service_->get(session);
  EXPECT_EQ(before.state(), v1::SESSION_STATE_FAILED);
  restart();
  Stream(*service_, frames_of(session)).finish();
  EXPECT_EQ(service_->get(session).SerializeAsString(), before.SerializeAsString());
}

// Also those that were sent to it and did not come: more than it read is under way to it.
TEST_F(Restart, HoldsFramesForAReaderThatComesBack) {
  history_bytes_ = 50'000;  // some 30 frames
  restart();
  const v1::Session session = service_->create();
  auto request = frames_of(session, 0, 500);
  request.set_slow_reader(v1::SLOW_READER_HOLD_SESSION);
  {
    Stream stream(*service_, request);
    service_->run(session, 500);
    for (int frame = 0; frame < 100; ++frame) EXPECT_EQ(stream.frame().number(), frame);
    wait_until_held();
    EXPECT_LT(service_->pause(session).applied_frame(), 500) << "it did not wait";
    service_.reset();
  }
  start();
  service_->run(session, 500);
  request.set_start_frame(100);
  Stream stream(*service_, request);
  const auto after = stream.rest();
  EXPECT_EQ(stream.finish().message, "");
  ASSERT_THAT(after, SizeIs(401));
  EXPECT_EQ(after.front().number(), 100);
}

TEST_F(Restart, RefusesADirectoryInUse) {
  ServerOptions options = Service::in_process();
  options.data_dir = directory_.name();
  try {
    const Server second(options);
    ADD_FAILURE() << "it serves";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("is used by another weftd"));
  }
}

std::string content(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

TEST_F(Restart, LosesOnlyTheSessionThatIsDamaged) {
  v1::Scene scene = small_scene();
  const v1::Session good = service_->create(scene, "good");
  scene.mutable_sheets(0)->set_name("treacherous");
  const v1::Session bad = service_->create(scene, "bad");
  service_->step(good, 5);
  service_->step(bad, 5);
  service_.reset();
  std::string bytes = content(file());
  const auto place = bytes.find("treacherous");
  ASSERT_NE(place, std::string::npos);
  bytes[place] = 'T';
  std::ofstream(file(), std::ios::binary) << bytes;

  start();
  EXPECT_EQ(service_->step(good).frame(), 6);
  v1::GetSessionRequest get;
  get.set_name(bad.name());
  const Error error = service_->error(&Sessions::GetSession, get);
  EXPECT_EQ(error.code, grpc::StatusCode::DATA_LOSS);
  EXPECT_EQ(error.reason(), "SESSION_DAMAGED");
  EXPECT_EQ(service_->create_error(small_scene(), "bad").code, grpc::StatusCode::ALREADY_EXISTS);
  service_->erase(bad);
  restart();
  EXPECT_EQ(service_->error(&Sessions::GetSession, get).code, grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(service_->step(good).frame(), 7);
}

TEST_F(Restart, NeverMistakesADamagedCallForASoundOne) {
  constexpr double kBend = 1.2345e-5;
  const v1::Session session = service_->create(small_scene(), "curtain");
  v1::UpdateTextileRequest update;
  update.set_name(session.name());
  update.mutable_update_mask()->add_paths("raw.bend_n_m2");
  update.mutable_textile()->mutable_raw()->set_bend_n_m2(kBend);
  ASSERT_EQ(service_->error(&Sessions::UpdateTextile, update).code, grpc::StatusCode::OK);
  service_.reset();
  const std::string good = content(file());
  const std::string value(reinterpret_cast<const char*>(&kBend), sizeof kBend);
  const auto place = good.find(value);
  ASSERT_NE(place, std::string::npos);
  for (std::size_t byte = 0; byte < value.size(); ++byte) {
    std::string bytes = good;
    bytes[place + byte] = static_cast<char>(bytes[place + byte] ^ 1);
    std::ofstream(file(), std::ios::binary) << bytes;
    start();
    v1::GetSessionRequest get;
    get.set_name(session.name());
    EXPECT_EQ(service_->error(&Sessions::GetSession, get).code, grpc::StatusCode::DATA_LOSS);
    service_.reset();
  }
}

// Whatever byte is changed: the server refuses the file, or has the session as it was, or says that
// it is damaged.
TEST_F(Restart, NeverMistakesDamageForASession) {
  const v1::Session session = service_->create(small_scene(), "curtain");
  for (int i = 0; i < 5; ++i) service_->step(session, 2);
  const std::string before = frames(session, 10).back().SerializeAsString();
  service_.reset();
  const std::string good = content(file());
  int found = 0;
  for (std::size_t place = 3; place < good.size(); place += 173) {
    std::string bytes = good;
    bytes[place] = static_cast<char>(bytes[place] ^ 0x11);
    std::ofstream(file(), std::ios::binary) << bytes;
    try {
      start();
      v1::GetSessionRequest get;
      get.set_name(session.name());
      const Error error = service_->error(&Sessions::GetSession, get);
      if (error.code == grpc::StatusCode::OK) {
        EXPECT_EQ(frames(session, 10).back().SerializeAsString(), before) << "byte " << place;
      } else {
        EXPECT_EQ(error.code, grpc::StatusCode::DATA_LOSS) << "byte " << place;
        ++found;
      }
    } catch (const std::runtime_error&) {
      ++found;
    }
    service_.reset();
  }
  EXPECT_GT(found, 0);
}

// A server that keeps a snapshot of every frame, as far as it comes to it.
class RestartWithSnapshots : public Restart {
 protected:
  RestartWithSnapshots() {
    snapshot_ms_ = 0;
    restart();
  }

  std::filesystem::path snapshots_of(const v1::Session& session) const {
    return std::filesystem::path(directory_.path("snapshots")) / session.uid();
  }
  // In the order in which they were taken.
  std::vector<std::filesystem::path> files_of(const v1::Session& session) const {
    std::vector<std::filesystem::path> files;
    for (const auto& file : std::filesystem::directory_iterator(snapshots_of(session)))
      if (std::isdigit(file.path().filename().string().front()) != 0) files.push_back(file.path());
    std::sort(files.begin(), files.end(),
              [](const auto& a, const auto& b) { return frame_of(a) < frame_of(b); });
    return files;
  }
  static std::int64_t frame_of(const std::filesystem::path& file) {
    return std::stoll(file.filename().string());
  }
  std::int64_t last_of(const v1::Session& session) const {
    if (!std::filesystem::exists(snapshots_of(session))) return -1;
    const auto files = files_of(session);
    return files.empty() ? -1 : frame_of(files.back());
  }
  // Steps until there is a snapshot of the newest frame. One is left out while the one before it is
  // written.
  std::int64_t kept(const v1::Session& session) {
    for (;;) {
      const std::int64_t before = last_of(session);
      const std::int64_t frame = service_->step(session).frame();
      const auto part = snapshots_of(session) / ".part";
      for (int look = 0; last_of(session) == before; ++look) {
        if (look > 50 && !std::filesystem::exists(part)) break;  // it was left out
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      if (last_of(session) == frame) return frame;
    }
  }
};

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

#include <filesystem>
#include <fstream>

#include "tests/support/service/service.h"
#include "tests/support/temporary_directory.h"

namespace weft::testing {
namespace {

using grpc::StatusCode;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using Sessions = Service::Sessions;

// A server that keeps sessions in memory, or in a directory.
class Snapshots : public ::testing::TestWithParam<bool> {
 protected:
  Snapshots() { start(); }

  void start() {
    ServerOptions options = Service::in_process();
    if (GetParam()) options.data_dir = directory_.name();
    options.limits.max_snapshots_per_session = 3;
    options.snapshot_ms = 0;
    service_ = std::make_unique<Service>(options);
  }
  // Where sessions are kept.
  void restart() {
    if (!GetParam()) return;
    service_.reset();
    start();
  }

  static v1::CreateSnapshotRequest create_request(const v1::Session& session,
                                                  const std::string& id = {}) {
    v1::CreateSnapshotRequest request;
    request.set_parent(session.name());
    request.set_snapshot_id(id);
    return request;
  }
  v1::Snapshot take(const v1::Session& session, const std::string& id = {}) {
    v1::Snapshot snapshot;
    const auto status =
        service_->call(&Sessions::CreateSnapshot, create_request(session, id), &snapshot);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return snapshot;
  }
  std::vector<v1::Snapshot> list(const v1::Session& session) {
    v1::ListSnapshotsRequest request;
    request.set_parent(session.name());
    v1::ListSnapshotsResponse response;
    EXPECT_TRUE(service_->call(&Sessions::ListSnapshots, request, &response).ok());
    return {response.snapshots().begin(), response.snapshots().end()};
  }
  static v1::RestoreSessionRequest restore_request(const std::string& snapshot,
                                                   const std::string& id = {}) {
    v1::RestoreSessionRequest request;
    request.set_name(snapshot);
    request.set_session_id(id);
    return request;
  }
  v1::Session restore(const std::string& snapshot, const std::string& id = {}) {
    v1::Session session;
    const auto status =
        service_->call(&Sessions::RestoreSession, restore_request(snapshot, id), &session);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return session;
  }
  void bend(const v1::Session& session, double value, double duration = 0) {
    v1::UpdateTextileRequest request;
    request.set_name(session.name());
    request.mutable_update_mask()->add_paths("raw.bend_n_m2");
    request.mutable_textile()->mutable_raw()->set_bend_n_m2(value);
    if (duration > 0) request.set_duration_s(duration);
    ASSERT_EQ(service_->error(&Sessions::UpdateTextile, request).code, StatusCode::OK);
  }
  void grab(const v1::Session& session, int particle) {
    v1::ApplyActionsRequest request;
    request.set_name(session.name());
    request.add_actions()->mutable_grab()->set_particle(particle);
    ASSERT_EQ(service_->error(&Sessions::ApplyActions, request).code, StatusCode::OK);
  }
  // Frames of both from `first` on, which are to be equal.
  void expect_equal(const v1::Session& a, const v1::Session& b, std::int64_t first,
                    std::int64_t last) {
    const auto frames = [&](const v1::Session& session) {
      return Stream(*service_, frames_of(session, first, last)).rest();
    };
    const auto found = frames(a), wanted = frames(b);
    ASSERT_EQ(found.size(), static_cast<std::size_t>(last - first + 1));
    ASSERT_EQ(found.size(), wanted.size());
    for (std::size_t i = 0; i < found.size(); ++i)
      ASSERT_EQ(found[i].SerializeAsString(), wanted[i].SerializeAsString())
          << "frame " << found[i].number();
  }

  const TemporaryDirectory directory_;
  std::unique_ptr<Service> service_;
};

TEST_P(Snapshots, GoOnInASessionOfTheirOwnWithTheFramesOfTheirs) {
  const v1::Session session = service_->create(small_scene(), "drape");
  service_->step(session, 10);
  bend(session, 3e-6, 0.3);
  grab(session, 13);
  service_->step(session, 5);
  const v1::Snapshot snapshot = take(session);
  EXPECT_EQ(snapshot.name(), "sessions/drape/snapshots/frame-15");
  EXPECT_EQ(snapshot.frame(), 15);
  EXPECT_DOUBLE_EQ(snapshot.time_s(), service_->get(session).time_s());
  EXPECT_GT(snapshot.size_bytes(), 20 * 6 * 8);
  EXPECT_EQ(snapshot.numerics_id(), session.numerics_id());
  EXPECT_EQ(snapshot.damage(), "");
  service_->step(session, 20);
  bend(session, 5e-6);
  service_->step(session, 5);

  const v1::Session other = restore(snapshot.name(), "other");
  EXPECT_EQ(other.name(), "sessions/other");
  EXPECT_NE(other.uid(), session.uid());
  EXPECT_EQ(other.state(), v1::SESSION_STATE_PAUSED);
  EXPECT_EQ(other.frame(), 15);
  service_->step(other, 10);
  expect_equal(other, session, 15, 25);
  restart();
  service_->step(other, 10);
  bend(other, 5e-6);
  service_->step(other, 10);
  service_->step(session, 5);
  expect_equal(other, session, 41, 45);
  EXPECT_EQ(service_->get(other).scene().SerializeAsString(),
            service_->get(session).scene().SerializeAsString());
  Stream before(*service_, frames_of(other, 14));
  EXPECT_EQ(before.finish().reason(), "FRAME_EXPIRED");
  EXPECT_THAT(list(other), SizeIs(0));
}

TEST_P(Snapshots, AreListedUntilTheirSessionIsDeleted) {
  const v1::Session session = service_->create();
  take(session, "first");
  service_->step(session, 3);
  take(session);
  const auto before = list(session);
  ASSERT_THAT(before, SizeIs(2));
  EXPECT_THAT(before[0].name(), ::testing::EndsWith("/snapshots/first"));
  EXPECT_EQ(before[1].frame(), 3);
  restart();
  const auto after = list(session);
  ASSERT_THAT(after, SizeIs(2));
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_EQ(after[i].SerializeAsString(), before[i].SerializeAsString());
  service_->erase(session);
  EXPECT_EQ(service_->error(&Sessions::RestoreSession, restore_request(before[0].name())).reason(),
            "SESSION_NOT_FOUND");
}

TEST_P(Snapshots, AreRefusedWithoutAChange) {
  const v1::Session session = service_->create();
  take(session);
  const auto refused = [&](const std::string& id) {
    return service_->error(&Sessions::CreateSnapshot, create_request(session, id));
  };
  Error error = refused("");
  EXPECT_EQ(error.code, StatusCode::ALREADY_EXISTS);
  EXPECT_EQ(error.reason(), "SNAPSHOT_EXISTS");
  EXPECT_EQ(error.resource.resource_name(), session.name() + "/snapshots/frame-0");
  EXPECT_THAT(refused("No Name").fields(), ElementsAre("snapshot_id"));
  take(session, "b");
  take(session, "c");
  error = refused("d");
  EXPECT_EQ(error.code, StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(error.quota.violations(0).subject(), "snapshots_per_session");
  EXPECT_THAT(list(session), SizeIs(3));

  const auto restored = [&](const std::string& name, const std::string& id) {
    return service_->error(&Sessions::RestoreSession, restore_request(name, id));
  };
  EXPECT_EQ(restored(session.name() + "/snapshots/e", "").reason(), "SNAPSHOT_NOT_FOUND");
  EXPECT_THAT(restored(session.name(), "").fields(), ElementsAre("name"));
  EXPECT_THAT(restored(session.name() + "/snapshots/b", "No").fields(), ElementsAre("session_id"));
  const std::string id = session.name().substr(session.name().find('/') + 1);
  EXPECT_EQ(restored(session.name() + "/snapshots/b", id).reason(), "SESSION_EXISTS");
  EXPECT_EQ(service_->info().sessions(), 1);
}

TEST_P(Snapshots, AreTakenAndRestoredOnceHoweverOftenTheyAreAskedFor) {
  const v1::Session session = service_->create();
  auto create = create_request(session);
  create.set_request_id("take");
  v1::Snapshot first, again;
  ASSERT_TRUE(service_->call(&Sessions::CreateSnapshot, create, &first).ok());
  service_->step(session, 5);
  auto restore = restore_request(first.name());
  restore.set_request_id("restore");
  v1::Session made, same;
  ASSERT_TRUE(service_->call(&Sessions::RestoreSession, restore, &made).ok());
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(service_->call(&Sessions::CreateSnapshot, create, &again).ok());
    EXPECT_EQ(again.SerializeAsString(), first.SerializeAsString());
    ASSERT_TRUE(service_->call(&Sessions::RestoreSession, restore, &same).ok());
    EXPECT_EQ(same.uid(), made.uid());
    restart();
  }
  v1::StepSessionRequest step;
  step.set_name(session.name());
  step.set_request_id("take");
  EXPECT_THAT(service_->error(&Sessions::StepSession, step).fields(), ElementsAre("request_id"));
}

TEST_P(Snapshots, AreTakenOfASessionThatRuns) {
  const v1::Session session = service_->create();
  service_->run(session, 1'000'000);
  const v1::Snapshot snapshot = take(session);
  const std::int64_t last = service_->pause(session).applied_frame() + 100;
  service_->run(session, last);
  const v1::Session other = restore(snapshot.name());
  service_->run(other, last);
  expect_equal(other, session, snapshot.frame(), last);
}

TEST_P(Snapshots, OfASessionThatFailedServe) {
  const v1::Session session = service_->create(diverging_scene());
  const v1::Snapshot snapshot = take(session);
  service_->run(session, 1000);
  Stream(*service_, frames_of(session)).finish();
  EXPECT_EQ(service_->error(&Sessions::CreateSnapshot, create_request(session, "b")).reason(),
            "SOLVER_FAILED");
  EXPECT_EQ(restore(snapshot.name()).frame(), 0);
}

TEST_P(Snapshots, LetGoOfWhatStreamsHeld) {
  const v1::Session session = service_->create();
  grpc::ClientContext context;
  const auto stream = service_->sessions->Interact(&context);
  v1::InteractRequest message;
  message.set_session(session.name());
  message.set_sequence(1);
  message.mutable_action()->mutable_grab()->set_particle(7);
  v1::InteractResponse response;
  ASSERT_TRUE(stream->Write(message) && stream->Read(&response));
  const v1::Session other = restore(take(session).name());
  service_->step(other, 1);
  grab(other, 7);
  context.TryCancel();
}

INSTANTIATE_TEST_SUITE_P(InMemory, Snapshots, ::testing::Values(false));
INSTANTIATE_TEST_SUITE_P(InADirectory, Snapshots, ::testing::Values(true));

// Whatever is damaged is named and never served, whether it was before the server came or since.
TEST(DamagedSnapshots, AreRefusedByName) {
  const TemporaryDirectory directory;
  ServerOptions options = Service::in_process();
  options.data_dir = directory.name();
  auto service = std::make_unique<Service>(options);
  const v1::Session session = service->create();
  v1::CreateSnapshotRequest create;
  create.set_parent(session.name());
  create.set_snapshot_id("here");
  v1::Snapshot snapshot;
  ASSERT_TRUE(service->call(&Sessions::CreateSnapshot, create, &snapshot).ok());
  const auto file =
      std::filesystem::path(directory.path("snapshots")) / session.uid() / "named" / "here";
  ASSERT_TRUE(std::filesystem::exists(file));
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 1);
  v1::RestoreSessionRequest restore;
  restore.set_name(snapshot.name());
  for (int round = 0; round < 2; ++round) {
    const Error error = service->error(&Sessions::RestoreSession, restore);
    EXPECT_EQ(error.code, StatusCode::DATA_LOSS);
    EXPECT_EQ(error.reason(), "SNAPSHOT_DAMAGED");
    EXPECT_EQ(error.resource.resource_name(), snapshot.name());
    service.reset();
    service = std::make_unique<Service>(options);
  }
  v1::ListSnapshotsRequest request;
  request.set_parent(session.name());
  v1::ListSnapshotsResponse list;
  ASSERT_TRUE(service->call(&Sessions::ListSnapshots, request, &list).ok());
  ASSERT_EQ(list.snapshots_size(), 1);
  EXPECT_THAT(list.snapshots(0).damage(), HasSubstr("checksum"));
  EXPECT_EQ(service->info().sessions(), 1);
  EXPECT_EQ(service->step(session).frame(), 1);
}

}  // namespace
}  // namespace weft::testing

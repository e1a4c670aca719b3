#include <gmock/gmock.h>

#include <algorithm>
#include <thread>

#include "server/store/store.h"
#include "tests/server/restart_support.h"
#include "tests/support/service/assets.h"

namespace weft::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;
using Sessions = Service::Sessions;

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

TEST_F(Restart, GoesOnWithABodyThatIsLed) {
  for (const int snapshot_ms : {3'600'000, 0}) {
    snapshot_ms_ = snapshot_ms;
    restart();
    const v1::Session session = service_->create(posed_scene());
    const v1::Session other = service_->create(posed_scene());
    v1::ApplyActionsRequest request;
    request.add_actions()->mutable_pose_collider()->set_pose_time_s(10.9);
    for (const v1::Session& each : {session, other}) {
      request.set_name(each.name());
      ASSERT_EQ(service_->error(&Sessions::ApplyActions, request).code, grpc::StatusCode::OK);
    }
    const auto pose_times = [&](const v1::Session& of) {
      v1::StreamFramesRequest late = frames_of(of, 7, 20);
      late.mutable_format()->set_stats(true);
      std::vector<double> times;
      for (const v1::Frame& frame : Stream(*service_, late).rest())
        for (const double time : frame.stats().pose_times_s()) times.push_back(time);
      return times;
    };
    service_->step(other, 20);
    const auto wanted = pose_times(other);
    ASSERT_THAT(wanted, SizeIs(14));
    EXPECT_NEAR(wanted.front(), 10 + 7 / 60.0 / 0.2, 1e-6) << "at 1 m/s";
    EXPECT_EQ(wanted.back(), 10.9);
    service_->step(session, 6);
    restart();
    service_->step(session, 14);
    EXPECT_EQ(pose_times(session), wanted);
  }
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

}  // namespace
}  // namespace weft::testing

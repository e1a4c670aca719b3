#include <thread>

#include "server/session/request.h"
#include "tests/support/service/service.h"

namespace weft::testing {
namespace {

using ::testing::ElementsAre;
using Sessions = Service::Sessions;

v1::StepSessionRequest step_request(const v1::Session& session, std::int64_t frames,
                                    const std::string& id) {
  v1::StepSessionRequest request;
  request.set_name(session.name());
  request.set_frames(frames);
  request.set_request_id(id);
  return request;
}

// A call that must succeed.
template <class Request, class Response>
Response ask(Service& service,
             grpc::Status (Sessions::*method)(grpc::ClientContext*, const Request&, Response*),
             const Request& request) {
  Response response;
  const grpc::Status status = service.call(method, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response;
}

TEST(RequestId, MakesASessionOnce) {
  Service service;
  v1::CreateSessionRequest request;
  *request.mutable_session()->mutable_scene() = small_scene();
  request.set_request_id("make");
  const v1::Session first = ask(service, &Sessions::CreateSession, request);
  EXPECT_EQ(ask(service, &Sessions::CreateSession, request).uid(), first.uid());
  EXPECT_EQ(service.info().sessions(), 1);
  request.set_session_id("other");
  const Error other = service.error(&Sessions::CreateSession, request);
  EXPECT_THAT(other.fields(), ElementsAre("request_id"));
  service.erase(first);
  request.clear_session_id();
  EXPECT_EQ(service.error(&Sessions::CreateSession, request).code, grpc::StatusCode::NOT_FOUND);
}

TEST(RequestId, DeletesASessionOnce) {
  Service service;
  v1::DeleteSessionRequest request;
  request.set_name(service.create(small_scene(), "curtain").name());
  request.set_request_id("delete");
  ask(service, &Sessions::DeleteSession, request);
  service.create(small_scene(), "curtain");
  ask(service, &Sessions::DeleteSession, request);
  EXPECT_EQ(service.info().sessions(), 1) << "the new one is another one";
}

TEST(RequestId, StepsOnceAndGivesTheFirstAnswerAgain) {
  Service service;
  const v1::Session session = service.create();
  const auto request = step_request(session, 5, "step");
  const auto first = ask(service, &Sessions::StepSession, request);
  service.step(session, 2);
  const auto again = ask(service, &Sessions::StepSession, request);
  EXPECT_EQ(again.SerializeAsString(), first.SerializeAsString());
  EXPECT_EQ(service.get(session).frame(), 7);
}

TEST(RequestId, OfAStepWhoseCallerWentAwayFindsItsAnswer) {
  Service service;
  const v1::Session session = service.create();
  const auto request = step_request(session, 2000, "step");
  Stream stream(service, frames_of(session));
  grpc::ClientContext context;
  std::jthread caller([&] {
    v1::StepSessionResponse response;
    EXPECT_EQ(service.sessions->StepSession(&context, request, &response).error_code(),
              grpc::StatusCode::CANCELLED);
  });
  while (stream.frame().number() < 3) {
  }
  context.TryCancel();
  const auto answer = ask(service, &Sessions::StepSession, request);
  EXPECT_EQ(answer.applied_frame(), 1);
  EXPECT_EQ(answer.frame(), 2000);
}

TEST(RequestId, OfAStepThatWasPausedDoesNotGoOnWithIt) {
  Service service;
  const v1::Session session = service.create();
  const auto request = step_request(session, 100'000, "step");
  Stream stream(service, frames_of(session));
  std::jthread caller([&] {
    EXPECT_EQ(service.error(&Sessions::StepSession, request).reason(), "STEP_INTERRUPTED");
  });
  while (stream.frame().number() < 3) {
  }
  const auto paused = service.pause(session);
  EXPECT_EQ(service.error(&Sessions::StepSession, request).reason(), "STEP_INTERRUPTED");
  EXPECT_EQ(service.get(session).frame(), paused.applied_frame() - 1);
}

TEST(RequestId, RunsPausesAndChangesTextilesOnce) {
  Service service;
  const v1::Session session = service.create();
  v1::RunSessionRequest run;
  run.set_name(session.name());
  run.set_until_frame(20);
  run.set_request_id("run");
  ask(service, &Sessions::RunSession, run);
  Stream(service, frames_of(session, 0, 20)).rest();
  EXPECT_EQ(ask(service, &Sessions::RunSession, run).applied_frame(), 1);
  EXPECT_EQ(service.get(session).state(), v1::SESSION_STATE_PAUSED);

  v1::PauseSessionRequest pause;
  pause.set_name(session.name());
  pause.set_request_id("pause");
  ask(service, &Sessions::PauseSession, pause);
  service.run(session, 1'000'000'000);
  EXPECT_EQ(ask(service, &Sessions::PauseSession, pause).applied_frame(), 21);
  EXPECT_EQ(service.get(session).state(), v1::SESSION_STATE_RUNNING);

  v1::UpdateTextileRequest update;
  update.set_name(session.name());
  update.mutable_textile()->set_preset("denim_11oz");
  update.set_request_id("update");
  const auto first = ask(service, &Sessions::UpdateTextile, update);
  const auto again = ask(service, &Sessions::UpdateTextile, update);
  EXPECT_EQ(again.SerializeAsString(), first.SerializeAsString());
}

TEST(RequestId, OfARefusedCallMayBeTriedAgain) {
  Service service;
  const v1::Session session = service.create();
  service.run(session, 1'000'000'000);
  const auto request = step_request(session, 1, "step");
  EXPECT_EQ(service.error(&Sessions::StepSession, request).reason(), "SESSION_RUNNING");
  service.pause(session);
  EXPECT_GT(ask(service, &Sessions::StepSession, request).frame(), 0);
}

TEST(RequestId, BelongsToOneCallOfASession) {
  Service service;
  const v1::Session session = service.create();
  ask(service, &Sessions::StepSession, step_request(session, 1, "step"));
  const Error frames = service.error(&Sessions::StepSession, step_request(session, 2, "step"));
  EXPECT_THAT(frames.fields(), ElementsAre("request_id"));
  v1::PauseSessionRequest pause;
  pause.set_name(session.name());
  pause.set_request_id("step");
  EXPECT_THAT(service.error(&Sessions::PauseSession, pause).fields(), ElementsAre("request_id"));
  const v1::Session other = service.create();
  EXPECT_EQ(ask(service, &Sessions::StepSession, step_request(other, 2, "step")).frame(), 2);
}

TEST(RequestId, IsPrintableAndShort) {
  Service service;
  const v1::Session session = service.create();
  for (const std::string& id : {std::string("a b"), std::string("\n"), std::string(129, 'x')}) {
    const Error error = service.error(&Sessions::StepSession, step_request(session, 1, id));
    EXPECT_THAT(error.fields(), ElementsAre("request_id"));
  }
  ask(service, &Sessions::StepSession, step_request(session, 1, std::string(128, 'x')));
}

TEST(RequestId, IsForgottenAfterManyOthers) {
  Answers<int> answers(3);
  for (int i = 0; i < 5; ++i) answers.remember({std::to_string(i), 7}, i);
  EXPECT_EQ(answers.find({"1", 7}), nullptr);
  EXPECT_EQ(answers.find({"2", 7})->answer, 2);
  EXPECT_EQ(answers.find({"", 0}), nullptr);
}

}  // namespace
}  // namespace weft::testing

#include <grpcpp/grpcpp.h>

#include <cstring>
#include <thread>

#include "tests/support/service/service.h"

namespace weft::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Sessions = Service::Sessions;

v1::Action grab(int particle) {
  v1::Action action;
  action.mutable_grab()->set_particle(particle);
  return action;
}

v1::Action drag(int particle, double y) {
  v1::Action action;
  action.mutable_drag()->set_particle(particle);
  action.mutable_drag()->mutable_target_m()->set_y(y);
  return action;
}

v1::ApplyActionsRequest request_of(const v1::Session& session,
                                   const std::vector<v1::Action>& actions) {
  v1::ApplyActionsRequest request;
  request.set_name(session.name());
  request.mutable_actions()->Add(actions.begin(), actions.end());
  return request;
}

// Height of a particle of the small scene in a frame, m.
double height(Service& service, const v1::Session& session, std::int64_t frame, int particle) {
  const v1::Frame found = Stream(service, frames_of(session, frame, frame)).frame();
  double y = 0;
  std::memcpy(&y,
              found.positions_m().data() + sizeof(double) * (20 + static_cast<unsigned>(particle)),
              sizeof y);
  return y;
}

// Waits until the particle can be grabbed: nobody holds it any more.
void expect_let_go(Service& service, const v1::Session& session, int particle) {
  const auto request = request_of(session, {grab(particle)});
  while (service.error(&Sessions::ApplyActions, request).code != grpc::StatusCode::OK) {
    std::this_thread::yield();
  }
}

// A call of Interact.
class Hand {
 public:
  explicit Hand(Sessions& sessions) : stream_(sessions.Interact(&context_)) {}
  explicit Hand(Service& service) : Hand(*service.sessions) {}

  void send(const v1::Session& session, std::int64_t sequence, const v1::Action& action) {
    v1::InteractRequest request;
    request.set_session(session.name());
    request.set_sequence(sequence);
    *request.mutable_action() = action;
    stream_->Write(request);
  }
  v1::InteractResponse answer() {
    v1::InteractResponse response;
    EXPECT_TRUE(stream_->Read(&response));
    return response;
  }
  void leave() { stream_->WritesDone(); }
  void die() { context_.TryCancel(); }
  Error finish() {
    v1::InteractResponse response;
    while (stream_->Read(&response)) {
    }
    return Error(stream_->Finish());
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::InteractRequest, v1::InteractResponse>> stream_;
};

TEST(ApplyActions, DoesAllOrNothingAndOnce) {
  Service service;
  const v1::Session session = service.create();
  service.step(session, 3);
  Error error = service.error(&Sessions::ApplyActions,
                              request_of(session, {grab(7), drag(99, 0), drag(8, 0)}));
  EXPECT_THAT(error.fields(), ElementsAre("actions[1].drag.particle", "actions[2].drag.particle"));
  EXPECT_EQ(error.reason(), "FIELD_INVALID");
  EXPECT_THAT(service.error(&Sessions::ApplyActions, request_of(session, {})).fields(),
              ElementsAre("actions"));
  v1::Action nothing, nowhere;
  nowhere.mutable_drag();
  EXPECT_THAT(
      service.error(&Sessions::ApplyActions, request_of(session, {nothing, nowhere})).fields(),
      ElementsAre("actions[0]", "actions[1].drag.target_m"));

  auto request = request_of(session, {grab(7), drag(7, -0.4)});
  request.set_request_id("once");
  v1::ApplyActionsResponse response;
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(service.call(&Sessions::ApplyActions, request, &response).ok());
    EXPECT_EQ(response.applied_frame(), 4);
  }
  service.step(session, 10);
  EXPECT_DOUBLE_EQ(height(service, session, 13, 7), -0.4);
}

TEST(Interact, AnswersEachMessageWithTheFrameThatShowsIt) {
  Service service;
  const v1::Session session = service.create();
  Hand hand(service);
  hand.send(session, 1, grab(7));
  EXPECT_EQ(hand.answer().applied_frame(), 1);
  service.step(session, 2);
  hand.send(session, 5, drag(7, -0.1));
  const v1::InteractResponse answer = hand.answer();
  EXPECT_EQ(answer.sequence(), 5);
  EXPECT_EQ(answer.applied_frame(), 3);
  service.step(session, 8);
  EXPECT_DOUBLE_EQ(height(service, session, 10, 7), -0.1);
  hand.leave();
  EXPECT_EQ(hand.finish().code, grpc::StatusCode::OK);
  service.step(session, 1);
  EXPECT_NE(height(service, session, 11, 7), -0.1) << "it was let go";
}

TEST(Interact, TakesTheNewestOfTheDragsThatWait) {
  Service service;
  const v1::Session session = service.create();
  service.run(session, 1'000'000'000);
  Hand hand(service);
  hand.send(session, 1, grab(7));
  std::jthread sender([&] {
    for (int i = 2; i <= 500; ++i) hand.send(session, i, drag(7, -0.001 * i));
  });
  v1::InteractResponse answer;
  for (std::int64_t last = 0; answer.sequence() < 500; last = answer.sequence()) {
    answer = hand.answer();
    ASSERT_GT(answer.sequence(), last);
  }
  const std::int64_t there = answer.applied_frame() + 10;
  Stream(service, frames_of(session, there, there)).frame();
  service.pause(session);
  EXPECT_DOUBLE_EQ(height(service, session, service.get(session).frame(), 7), -0.5);
}

TEST(Interact, LetsGoWhenTheClientDiesOrErrsAndOnlyOfItsOwn) {
  Service service;
  const v1::Session session = service.create();
  EXPECT_EQ(service.error(&Sessions::ApplyActions, request_of(session, {grab(8)})).code,
            grpc::StatusCode::OK);
  {
    Hand hand(service);
    hand.send(session, 1, grab(7));
    hand.answer();
    hand.die();
    expect_let_go(service, session, 7);
  }
  Hand hand(service);
  hand.send(session, 1, grab(9));
  hand.answer();
  hand.send(session, 2, drag(8, 0));
  const Error error = hand.finish();
  EXPECT_THAT(error.fields(), ElementsAre("action.drag.particle"));
  EXPECT_THAT(error.message, HasSubstr("8 is grabbed by another stream or call"));
  EXPECT_THAT(service.error(&Sessions::ApplyActions, request_of(session, {grab(9)})).fields(),
              ElementsAre())
      << "its end is answered when it has let go";
  EXPECT_THAT(service.error(&Sessions::ApplyActions, request_of(session, {grab(8)})).fields(),
              ElementsAre("actions[0].grab.particle"));
}

TEST(Interact, EndsWithAServerThatDrainsAndRefusesNonsense) {
  ServerOptions options = Service::in_process();
  options.host = "127.0.0.1";
  Service service(options);
  const v1::Session session = service.create();
  // over a socket: in a process gRPC drops the end of a call whose client may still write
  const auto remote = v1::SessionService::NewStub(
      grpc::CreateChannel(service.server.address(), grpc::InsecureChannelCredentials()));
  Hand hand(*remote), confused(service);
  hand.send(session, 1, grab(7));
  hand.answer();
  confused.send(session, 0, grab(8));
  EXPECT_THAT(confused.finish().fields(), ElementsAre("sequence"));
  EXPECT_EQ(raw_call(service, "/weft.v1.SessionService/Interact", "\xff\xff").second.reason(),
            "MESSAGE_MALFORMED");
  const std::jthread reader([&] { EXPECT_EQ(hand.finish().reason(), "SERVER_DRAINING"); });
  service.server.stop();
}

}  // namespace
}  // namespace weft::testing

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <thread>

#include "tests/support/service/service.h"

namespace weft::testing {
namespace {

using ::testing::ElementsAre;

// A server that listens: in a process gRPC drops the end of a call whose client may still write.
ServerOptions listening() {
  ServerOptions options = Service::in_process();
  options.host = "127.0.0.1";
  options.limits.history_bytes_per_session = 20'000;  // a few frames of the small scene
  return options;
}

v1::ViewFramesRequest view_of(const v1::Session& session, int credits) {
  v1::ViewFramesRequest request;
  request.set_session(session.name());
  request.mutable_format()->set_encoding(v1::FRAME_ENCODING_FLOAT64);
  request.set_credits(credits);
  return request;
}

// A call of ViewFrames.
class View {
 public:
  View(Service& service, const v1::ViewFramesRequest& request,
       std::chrono::milliseconds deadline = std::chrono::seconds(60))
      : stub_(v1::FrameService::NewStub(
            grpc::CreateChannel(service.server.address(), grpc::InsecureChannelCredentials()))) {
    context_.set_deadline(std::chrono::system_clock::now() + deadline);
    stream_ = stub_->ViewFrames(&context_);
    stream_->Write(request);
  }
  ~View() { context_.TryCancel(); }
  View(const View&) = delete;
  View& operator=(const View&) = delete;

  void send(const v1::ViewFramesRequest& request) { stream_->Write(request); }
  void grant(int credits) {
    v1::ViewFramesRequest request;
    request.set_credits(credits);
    send(request);
  }
  void leave() { stream_->WritesDone(); }
  // The next with a frame; an empty one where the call has ended.
  v1::ViewFramesResponse frame() {
    v1::ViewFramesResponse message;
    while (stream_->Read(&message)) {
      if (message.has_frame()) return message;
      if (message.has_header()) header = message.header();
    }
    return {};
  }
  Error finish() {
    while (frame().has_frame()) {
    }
    return Error(stream_->Finish());
  }

  v1::StreamHeader header;

 private:
  std::unique_ptr<v1::FrameService::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::ViewFramesRequest, v1::ViewFramesResponse>> stream_;
};

TEST(ViewFrames, SendsTheNewestFrameForACreditAndHoldsUpNobody) {
  Service service(listening());
  const v1::Session session = service.create();
  View view(service, view_of(session, 1));
  EXPECT_EQ(view.frame().frame().number(), 0);
  EXPECT_EQ(view.header.uid(), session.uid());
  service.step(session, 2000);
  view.grant(1);
  const v1::ViewFramesResponse newest = view.frame();
  EXPECT_EQ(newest.frame().SerializeAsString(),
            Stream(service, frames_of(session, 2000, 2000)).frame().SerializeAsString());
  EXPECT_EQ(newest.skipped_count(), 1999);
}

TEST(ViewFrames, SaysOfEveryFrameHowManyItSkipped) {
  Service service(listening());
  const v1::Session session = service.create();
  service.step(session, 7);
  View view(service, view_of(session, 2));
  std::int64_t next = view.frame().frame().number();
  EXPECT_EQ(next++, 7);
  service.run(session, 1'000'000);
  for (int i = 0; i < 50; ++i) {
    const v1::ViewFramesResponse message = view.frame();
    ASSERT_EQ(message.frame().number(), next + message.skipped_count());
    next = message.frame().number() + 1;
    view.grant(1);
  }
  EXPECT_EQ(view.header.start_frame(), 7);
}

TEST(ViewFrames, OfASessionThatStandsStillSendsItsNewestFrameOnce) {
  Service service(listening());
  const v1::Session session = service.create();
  View view(service, view_of(session, 3));
  EXPECT_EQ(view.frame().frame().number(), 0);
  service.step(session, 1);
  EXPECT_EQ(view.frame().frame().number(), 1);
}

TEST(ViewFrames, ServesWhatWasGrantedWhenTheClientHalfCloses) {
  Service service(listening());
  const v1::Session session = service.create();
  View view(service, view_of(session, 2));
  view.leave();
  EXPECT_EQ(view.frame().frame().number(), 0);
  service.step(session, 1);
  EXPECT_EQ(view.frame().frame().number(), 1);
  EXPECT_EQ(view.finish().code, grpc::StatusCode::OK);
}

TEST(ViewFrames, TakesOneCreditForAFrameThatComesInSeveralMessages) {
  ServerOptions options = listening();
  options.limits.max_frame_bytes = 1024;
  Service service(options);
  const v1::Session session = service.create();
  service.step(session, 5);
  auto request = view_of(session, 1);
  request.mutable_format()->set_encoding(v1::FRAME_ENCODING_FLOAT64);
  request.mutable_format()->set_velocities(true);
  View view(service, request);
  EXPECT_TRUE(view.frame().frame().continued());
  EXPECT_FALSE(view.frame().frame().continued());
  service.step(session, 9);
  view.grant(1);
  for (const bool continued : {true, false}) {
    const v1::ViewFramesResponse part = view.frame();
    EXPECT_EQ(part.frame().number(), 14);
    EXPECT_EQ(part.frame().continued(), continued);
    EXPECT_EQ(part.skipped_count(), 8);
  }
}

TEST(ViewFrames, EndsWithItsSessionAlsoWithoutACredit) {
  Service service(listening());
  const v1::Session session = service.create();
  View view(service, view_of(session, 1));
  view.frame();
  service.erase(session);
  EXPECT_EQ(view.finish().reason(), "SESSION_NOT_FOUND");
}

TEST(ViewFrames, EndsAfterTheLastGoodFrameOfASolverThatDiverged) {
  Service service(listening());
  const v1::Session session = service.create(diverging_scene());
  View view(service, view_of(session, 1));
  service.run(session, 100'000);
  std::int64_t last = -1;
  for (v1::ViewFramesResponse message; (message = view.frame()).has_frame(); view.grant(1))
    last = message.frame().number();
  const Error error = view.finish();
  EXPECT_EQ(error.reason(), "SOLVER_FAILED");
  EXPECT_EQ(error.metadata("latest_frame"), std::to_string(last));
}

TEST(ViewFrames, EndsWithAServerThatDrains) {
  Service service(listening());
  const v1::Session session = service.create();
  View view(service, view_of(session, 1)), silent(service, {});
  view.frame();
  EXPECT_THAT(silent.finish().fields(), ElementsAre("session"));
  const std::jthread reader([&] {
    const Error error = view.finish();
    EXPECT_EQ(error.reason(), "SERVER_DRAINING");
    EXPECT_EQ(error.metadata("last_frame"), "0");
  });
  service.server.stop();
}

TEST(ViewFrames, GivesBackItsPlaceAtTheDeadline) {
  ServerOptions options = listening();
  options.limits.max_streams = 1;
  Service service(options);
  const v1::Session session = service.create();
  View late(service, view_of(session, 2), std::chrono::milliseconds(100));
  EXPECT_EQ(late.finish().code, grpc::StatusCode::DEADLINE_EXCEEDED);
  while (View(service, view_of(session, 1)).frame().frame().positions_m().empty()) {
  }
}

TEST(ViewFrames, RefusesRequestsThatMakeNoSense) {
  Service service(listening());
  const v1::Session session = service.create();
  const auto fields_of = [&](const v1::ViewFramesRequest& then) {
    View view(service, view_of(session, 64));
    view.frame();  // 63 are open
    view.send(then);
    return view.finish().fields();
  };
  v1::ViewFramesRequest request;
  request.set_credits(2);
  EXPECT_THAT(fields_of(request), ElementsAre("credits"));
  EXPECT_THAT(fields_of(view_of(session, 1)), ElementsAre("session", "format"));
  const Error error =
      raw_call(service, "/weft.v1.FrameService/ViewFrames", "\xff\xff\xff\xff").second;
  EXPECT_EQ(error.reason(), "MESSAGE_MALFORMED");
}

}  // namespace
}  // namespace weft::testing

#include <gmock/gmock.h>

#include <chrono>
#include <deque>

#include "client/attempts.h"
#include "client/connection.h"
#include "client/frame_feed.h"
#include "tests/client/fake_fleet.h"

namespace weft::testing {
namespace {

using namespace std::chrono_literals;
using client::Problem;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;
using Sessions = v1::SessionService::Stub;

v1::StepSessionRequest step(const std::string& request_id = {}) {
  v1::StepSessionRequest request;
  request.set_name("sessions/cloth");
  request.set_request_id(request_id);
  return request;
}

// The errors that a fleet answers with, and a connection to it.
struct Fleet {
  explicit Fleet(std::deque<grpc::Status> errors) : servers(std::move(errors)) {}
  FakeFleet servers;
  std::unique_ptr<client::Connection> connection = client::Connection::to(servers.address(), {});
};

TEST(ClientOfAFleet, AsksTheReplicaThatHasTheSession) {
  Fleet fleet({wrong_replica("weftd-2")});
  EXPECT_EQ(fleet.connection->get_session("sessions/cloth").name(), "sessions/cloth");
  EXPECT_THAT(
      fleet.servers.attempts(),
      ElementsAre(Attempt{.session = "cloth"}, Attempt{.session = "cloth", .replica = "weftd-2"}));
}

TEST(ClientOfAFleet, ForgetsAReplicaThatIsGone) {
  Fleet fleet({wrong_replica("weftd-2"), stream_removed(), wrong_replica("weftd-3")});
  fleet.connection->get_session("sessions/cloth");
  const auto replica = [](const char* name) { return Field(&Attempt::replica, name); };
  EXPECT_THAT(fleet.servers.attempts(),
              ElementsAre(replica(""), replica("weftd-2"), replica(""), replica("weftd-3")));
}

TEST(ClientOfAFleet, NamesTheSessionThatACallSpeaksOf) {
  Fleet fleet({});
  v1::CreateSessionRequest create;
  fleet.connection->call(&Sessions::CreateSession, create);
  create.set_session_id("cloth");
  fleet.connection->call(&Sessions::CreateSession, create);
  fleet.connection->call(&Sessions::StepSession, step());
  fleet.connection->get_session("sessions/cloth/and/more");
  fleet.connection->get_session("sessions/no name,\nbut tr\xc3\xa4sh");
  const auto session = [](const char* name) { return Field(&Attempt::session, name); };
  EXPECT_THAT(fleet.servers.attempts(), ElementsAre(session(""), session("cloth"), session("cloth"),
                                                    session("cloth"), session("")));
}

TEST(ClientOfAFleet, RepeatsACallUnderItsName) {
  Fleet fleet({stream_removed(),
               draining(),
               {grpc::StatusCode::UNAVAILABLE, "503"},
               refusal(grpc::StatusCode::UNAVAILABLE, "STORE_UNREACHABLE")});
  fleet.connection->call(&Sessions::StepSession, step());
  const auto attempts = fleet.servers.attempts();
  ASSERT_EQ(attempts.size(), 5);
  EXPECT_THAT(attempts, Each(AllOf(Field(&Attempt::request_id, Not("")),
                                   Field(&Attempt::request_id, attempts[0].request_id))));
  fleet.connection->call(&Sessions::StepSession, step());
  EXPECT_NE(fleet.servers.attempts()[5].request_id, attempts[0].request_id);
}

TEST(ClientOfAFleet, KeepsTheNameThatItsCallerGave) {
  Fleet fleet({stream_removed()});
  fleet.connection->call(&Sessions::StepSession, step("mine"));
  EXPECT_THAT(fleet.servers.attempts(), ElementsAre(Field(&Attempt::request_id, "mine"),
                                                    Field(&Attempt::request_id, "mine")));
}

TEST(ClientOfAFleet, RepeatsNothingThatWasAnswered) {
  for (const grpc::Status& answer :
       {refusal(grpc::StatusCode::NOT_FOUND, "SESSION_NOT_FOUND"),
        refusal(grpc::StatusCode::UNAVAILABLE, "STORE_UNWRITABLE"),
        grpc::Status(grpc::StatusCode::INVALID_ARGUMENT, "of gRPC itself"),
        grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, "of gRPC itself")}) {
    Fleet fleet({answer});
    EXPECT_THROW(fleet.connection->get_session("sessions/cloth"), Problem);
    EXPECT_EQ(fleet.servers.attempts().size(), 1) << answer.error_message();
  }
}

TEST(ClientOfAFleet, GivesUpWithWhatTheLastServerSaid) {
  Fleet fleet({});
  client::Attempts attempts(*fleet.connection, v1::GetSessionRequest(), 100ms);
  const auto fail = [&] {
    attempts.go_on_after(draining());
    for (;;) attempts.go_on_after(stream_removed());
  };
  EXPECT_THAT(fail, ThrowsMessage<Problem>(HasSubstr("SERVER_DRAINING")));
}

TEST(ClientOfAFleet, SaysAtOnceThatNobodyIsThere) {
  const auto nowhere = client::Connection::to("127.0.0.1:1", {});
  const auto start = std::chrono::steady_clock::now();
  EXPECT_THAT([&] { nowhere->get_session("sessions/cloth"); },
              ThrowsMessage<Problem>(HasSubstr("no connection to 127.0.0.1:1")));
  EXPECT_LT(std::chrono::steady_clock::now() - start, client::kPatience / 2);
}

TEST(ClientOfAFleet, RepeatsAnInteractionOnlyWhereNothingWasDone) {
  Fleet fleet({});
  v1::InteractRequest first;
  first.set_session("sessions/cloth");
  client::Attempts attempts(*fleet.connection, first);
  EXPECT_NO_THROW(attempts.go_on_after(wrong_replica("weftd-2")));
  EXPECT_THROW(attempts.go_on_after(stream_removed()), Problem);
  EXPECT_THROW(attempts.go_on_after(draining()), Problem);
  attempts.note_message();
  EXPECT_THROW(attempts.go_on_after(wrong_replica("weftd-2")), Problem);
}

TEST(ClientOfAFleet, ReadsOnWhereAStreamBroke) {
  Fleet fleet({stream_removed(), draining(), wrong_replica("weftd-2")});
  v1::StreamFramesRequest request;
  request.set_session("sessions/cloth");
  request.set_start_frame(0);
  request.set_end_frame(9);
  client::FrameFeed feed(*fleet.connection, request, 60s);
  std::int64_t due = 0;
  while (const auto message = feed.next()) {
    if (message->has_frame()) {
      EXPECT_EQ(message->frame().number(), due++);
    }
  }
  EXPECT_EQ(due, 10);
  EXPECT_EQ(feed.reconnections(), 3);
  EXPECT_THAT(
      fleet.servers.attempts(),
      ElementsAre(
          Attempt{.session = "cloth"},
          Attempt{.session = "cloth", .uid = "uid-1", .start_frame = 2},
          Attempt{.session = "cloth", .uid = "uid-1", .start_frame = 4},
          Attempt{.session = "cloth", .replica = "weftd-2", .uid = "uid-1", .start_frame = 6}));
}

}  // namespace
}  // namespace weft::testing

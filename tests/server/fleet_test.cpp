#include <chrono>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "server/store/assets.h"
#include "server/store/records.h"
#include "tests/server/fleet_support.h"
#include "tests/support/service/assets.h"

// libpqxx 6.4 loses the answer to what it sends on a connection that turns out to be broken.
extern "C" const char* __lsan_default_suppressions();
const char* __lsan_default_suppressions() { return "leak:libpqxx"; }

namespace weft::testing {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::SizeIs;
using Sessions = Service::Sessions;
using std::chrono::milliseconds, std::chrono::seconds;

TEST_F(Fleet, HasASessionOnOneServerWhichTheOthersName) {
  const auto a = server("a"), b = server("b");
  const v1::Session session = a->create(small_scene(), "curtain");
  EXPECT_EQ(session.replica(), "a");
  EXPECT_EQ(a->info().replica(), "a");
  const Error error = get_error(*b, session);
  EXPECT_EQ(error.code, grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(error.reason(), "WRONG_REPLICA");
  EXPECT_EQ(error.metadata("replica"), "a");
  EXPECT_TRUE(error.retry);
  EXPECT_EQ(Stream(*b, frames_of(session)).finish().reason(), "WRONG_REPLICA");
  v1::Session nobodys;
  nobodys.set_name("sessions/nobodys");
  EXPECT_EQ(get_error(*b, nobodys).code, grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(a->get(session).uid(), session.uid());
}

TEST_F(Fleet, ListsTheSessionsOfAllServersPageByPage) {
  const auto a = server("a"), b = server("b");
  for (const char* id : {"one", "three", "five"}) a->create(small_scene(), id);
  for (const char* id : {"two", "four"}) b->create(small_scene(), id);
  std::vector<std::string> found;
  v1::ListSessionsRequest request;
  request.set_page_size(2);
  do {
    v1::ListSessionsResponse response;
    ASSERT_TRUE(b->call(&Sessions::ListSessions, request, &response).ok());
    for (const auto& session : response.sessions()) {
      found.push_back(session.name().substr(9) + "@" + session.replica());
      const bool here = session.replica() == "b";
      EXPECT_EQ(session.state(), here ? v1::SESSION_STATE_PAUSED : v1::SESSION_STATE_UNSPECIFIED);
      EXPECT_EQ(session.scene().sheets_size(), 1);
    }
    request.set_page_token(response.next_page_token());
  } while (!request.page_token().empty());
  EXPECT_THAT(found, ElementsAre("five@a", "four@b", "one@a", "three@a", "two@b"));
}

TEST_F(Fleet, ListsTheOthersWhereASceneIsNoneThatThisVersionKnows) {
  const auto a = server("a"), b = server("b");
  a->create(small_scene(), "curtain");
  const std::string uid = a->create(small_scene(), "puzzle").uid(), record = "\x01";
  change("UPDATE weft.scene SET record = '\\x01', checksum = " +
         std::to_string(records::checksum(uid, record)) + " WHERE uid = '" + uid + "'");
  v1::ListSessionsResponse listed;
  ASSERT_TRUE(b->call(&Sessions::ListSessions, {}, &listed).ok());
  ASSERT_THAT(listed.sessions(), SizeIs(1));
  EXPECT_EQ(listed.sessions(0).name(), "sessions/curtain");
}

TEST_F(Fleet, HasOneSessionOfAName) {
  const auto a = server("a"), b = server("b");
  a->create(small_scene(), "curtain");
  EXPECT_EQ(b->create_error(small_scene(), "curtain").code, grpc::StatusCode::ALREADY_EXISTS);
}

TEST_F(Fleet, GoesOnElsewhereAfterADrainWithTheSameFrames) {
  for (const int snapshot_ms : {2000, 0}) {  // by the log; by snapshots
    snapshot_ms_ = snapshot_ms;
    auto a = server("a");
    const auto b = server("b");
    const v1::Session session = a->create();
    a->step(session, 10);
    set_preset(*a, session, "denim_11oz");
    a->run(session, 40);
    const std::int64_t first = snapshot_ms > 0 ? 0 : 40;
    const auto before = frames(*a, session, 40, first);
    a.reset();
    const v1::Session taken = insist(*b, session);
    EXPECT_EQ(taken.uid(), session.uid());
    EXPECT_EQ(taken.replica(), "b");
    expect_equal(frames(*b, session, 40, first), before);
    b->step(session, 1);
    b->erase(session);
  }
  EXPECT_EQ(count("SELECT count(*) FROM weft.entry"), 0);
}

TEST_F(Fleet, GoesOnElsewhereAfterAKillWithTheSameFrames) {
  Replica a = replica("a");
  const auto b = server("b");
  const v1::Session session = a.create("curtain");
  a.step(session, 30);
  a.kill();
  const auto killed = std::chrono::steady_clock::now();
  EXPECT_EQ(insist(*b, session).frame(), 30);
  EXPECT_LT(std::chrono::steady_clock::now() - killed, seconds(20));  // some 10 ms
  b->step(session, 10);
  expect_equal(frames(*b, session, 40), undisturbed(*b, 40));
}

TEST_F(Fleet, GoesOnWithARunThatNobodyAsksForWhenItsServerDies) {
  Replica a = replica("a");
  const v1::Session session = a.create("curtain");
  v1::RunSessionRequest request;
  request.set_name(session.name());
  v1::RunSessionResponse response;
  ASSERT_TRUE(a.call(&Sessions::RunSession, request, &response).ok());
  const auto b = server("b");
  ASSERT_EQ(b->info().sessions(), 0);
  a.kill();
  while (b->info().sessions() == 0) ask_later();
  EXPECT_EQ(insist(*b, session).state(), v1::SESSION_STATE_RUNNING);
}

// Stopped past its lease, it comes back to a session that is another's.
TEST_F(Fleet, LetsAnOldOwnerWriteNothing) {
  const Replica a = replica("a");
  const auto b = server("b");
  const v1::Session session = a.create("curtain");
  a.step(session, 5);
  a.freeze();
  EXPECT_EQ(get_error(*b, session).reason(), "WRONG_REPLICA") << "the lease still runs";
  insist(*b, session);
  b->step(session, 5);

  // sent while it could not see that it is not its own any more
  v1::StepSessionRequest request;
  request.set_name(session.name());
  v1::StepSessionResponse response;
  grpc::Status status;
  std::jthread caller([&] { status = a.call(&Sessions::StepSession, request, &response); });
  std::this_thread::sleep_for(milliseconds(50));
  a.thaw();
  caller.join();
  EXPECT_EQ(Error(status).reason(), "WRONG_REPLICA") << status.error_message();
  EXPECT_EQ(b->get(session).frame(), 10);
  EXPECT_EQ(count("SELECT count(*) FROM weft.entry"), 2) << "one step of each";
  b->step(session, 10);
  expect_equal(frames(*b, session, 20), undisturbed(*b, 20));
}

TEST_F(Fleet, TellsStreamsOfAnOldOwnerThatTheSessionIsElsewhere) {
  const auto a = server("a"), b = server("b");
  const v1::Session session = a->create();
  a->step(session, 3);
  Stream stream(*a, frames_of(session));
  EXPECT_EQ(stream.frame().number(), 0);
  change(
      "WITH moved AS (UPDATE weft.session SET owner = (SELECT number FROM weft.replica WHERE "
      "name = 'b'), epoch = epoch + 1 RETURNING 1) SELECT count(*) FROM moved");
  v1::PauseSessionRequest request;
  request.set_name(session.name());
  EXPECT_EQ(a->error(&Sessions::PauseSession, request).reason(), "WRONG_REPLICA");
  EXPECT_EQ(stream.finish().reason(), "WRONG_REPLICA");
  EXPECT_EQ(insist(*b, session).frame(), 3);
}

TEST_F(Fleet, HasASessionThatNobodyUsedWhereItIsNamedNext) {
  ServerOptions idle = options("a");
  idle.idle = milliseconds(100);
  Service a(idle);
  const auto b = server("b");
  const v1::Session session = a.create(small_scene(), "curtain");
  a.step(session, 12);
  while (a.info().sessions() > 0) ask_later();
  EXPECT_EQ(b->create_error(small_scene(), "curtain").code, grpc::StatusCode::ALREADY_EXISTS);
  EXPECT_EQ(insist(*b, session).replica(), "b");
  EXPECT_EQ(b->get(session).frame(), 12);
  EXPECT_EQ(get_error(a, session).metadata("replica"), "b");
}

TEST_F(Fleet, CarriesANamedCallOutOnceWhicheverServerIsAsked) {
  auto a = server("a");
  const auto b = server("b");
  v1::CreateSessionRequest create;
  *create.mutable_session()->mutable_scene() = small_scene();
  create.set_request_id("make");
  v1::Session session;
  ASSERT_TRUE(a->call(&Sessions::CreateSession, create, &session).ok());
  EXPECT_EQ(b->error(&Sessions::CreateSession, create).reason(), "WRONG_REPLICA");

  v1::StepSessionRequest step;
  step.set_name(session.name());
  step.set_frames(7);
  step.set_request_id("step");
  v1::StepSessionResponse first, again;
  ASSERT_TRUE(a->call(&Sessions::StepSession, step, &first).ok());
  a.reset();
  insist(*b, session);
  ASSERT_TRUE(b->call(&Sessions::StepSession, step, &again).ok());
  EXPECT_EQ(again.SerializeAsString(), first.SerializeAsString());
  v1::Session same;
  ASSERT_TRUE(b->call(&Sessions::CreateSession, create, &same).ok());
  EXPECT_EQ(same.uid(), session.uid());
  create.set_session_id("other");
  EXPECT_THAT(b->error(&Sessions::CreateSession, create).fields(), ElementsAre("request_id"));

  v1::DeleteSessionRequest erase;
  erase.set_name(session.name());
  erase.set_request_id("delete");
  const auto c = server("c");
  ASSERT_EQ(b->error(&Sessions::DeleteSession, erase).code, grpc::StatusCode::OK);
  EXPECT_EQ(c->error(&Sessions::DeleteSession, erase).code, grpc::StatusCode::OK);
  create.clear_session_id();
  EXPECT_EQ(c->error(&Sessions::CreateSession, create).code, grpc::StatusCode::NOT_FOUND);
}

TEST_F(Fleet, KeepsSnapshotsOnDemandForEveryServer) {
  auto a = server("a");
  const auto b = server("b");
  const v1::Session session = a->create();
  a->step(session, 12);
  v1::CreateSnapshotRequest request;
  request.set_parent(session.name());
  request.set_snapshot_id("before");
  ASSERT_EQ(a->error(&Sessions::CreateSnapshot, request).code, grpc::StatusCode::OK);
  a->step(session, 8);
  a.reset();
  insist(*b, session);
  v1::RestoreSessionRequest restore;
  restore.set_name(session.name() + "/snapshots/before");
  v1::Session other;
  ASSERT_TRUE(b->call(&Sessions::RestoreSession, restore, &other).ok());
  EXPECT_EQ(other.frame(), 12);
  b->step(other, 8);
  const auto newest = [&](const v1::Session& of) {
    return Stream(*b, frames_of(of, 20, 20)).rest().at(0).positions_m();
  };
  EXPECT_EQ(newest(other), newest(session));
}

TEST_F(Fleet, TellsNobodyWhereTheSessionsOfOthersAre) {
  const TemporaryDirectory directory;
  std::ofstream(directory.path("tokens"))  // SHA-256 of "a1" and "b1"
      << "ann f55ff16f66f43360266b95db6f8fec01d76031054306ae4a4b380598f6cfd114\n"
         "bob 7dc96f776c8423e57a2785489a3f9c43fb6e756876d6ad9a9cac4aa4e72ec193\n";
  const auto start = [&](const std::string& name) {
    ServerOptions with_tokens = options(name);
    with_tokens.tokens = directory.path("tokens");
    with_tokens.host = "127.0.0.1";
    auto service = std::make_unique<Service>(with_tokens);
    service->channel =
        grpc::CreateChannel(service->server.address(), grpc::InsecureChannelCredentials());
    return service;
  };
  const auto a = start("a"), b = start("b");
  const auto ask = [](Service& service, const std::string& token, const std::string& method,
                      const google::protobuf::Message& request) {
    return raw_call(service, "/weft.v1.SessionService/" + method, request.SerializeAsString(),
                    false, token);
  };
  v1::CreateSessionRequest create;
  *create.mutable_session()->mutable_scene() = small_scene();
  create.set_session_id("hers");
  ASSERT_EQ(ask(*a, "a1", "CreateSession", create).second.code, grpc::StatusCode::OK);
  EXPECT_EQ(ask(*b, "b1", "CreateSession", create).second.code,
            grpc::StatusCode::PERMISSION_DENIED);
  v1::GetSessionRequest get;
  get.set_name("sessions/hers");
  EXPECT_EQ(ask(*b, "a1", "GetSession", get).second.reason(), "WRONG_REPLICA");
  EXPECT_EQ(ask(*b, "b1", "GetSession", get).second.reason(), "SESSION_NOT_YOURS");
  v1::ListSessionsResponse hers, his;
  ASSERT_TRUE(hers.ParseFromString(ask(*b, "a1", "ListSessions", v1::ListSessionsRequest()).first));
  ASSERT_TRUE(his.ParseFromString(ask(*b, "b1", "ListSessions", v1::ListSessionsRequest()).first));
  EXPECT_THAT(hers.sessions(), SizeIs(1));
  EXPECT_THAT(his.sessions(), SizeIs(0));
}

TEST_F(Fleet, GoesOnWithAnUploadThatAnotherServerBegan) {
  const auto a = server("a"), b = server("b");
  const std::string bytes = square_mesh(300).SerializeAsString(), name = name_of_asset(bytes);
  const auto size = static_cast<std::int64_t>(bytes.size());
  {
    Upload begun(*a->assets, name, size);
    begun.send(0, bytes.substr(0, Assets::kPiece));
    while (get_asset(*b->assets, name).first.received_bytes() == 0)
      std::this_thread::sleep_for(milliseconds(1));
  }
  EXPECT_EQ(upload(*b->assets, bytes).first.received_bytes(), size);
  EXPECT_EQ(download(*a->assets, name).first, bytes);
}

TEST_F(Fleet, GoesOnWithASessionThatNamesAnAsset) {
  auto a = server("a");
  const auto b = server("b");
  const v1::MeshData mesh = square_mesh(4);
  const std::string name = name_of_asset(mesh.SerializeAsString());
  const v1::Session session = a->create(scene_of(mesh));
  a->step(session, 10);
  const auto before = frames(*a, session, 10);
  EXPECT_EQ(delete_asset(*b->assets, name).reason(), "ASSET_USED");
  v1::ListSessionsResponse listed;
  ASSERT_TRUE(b->call(&Sessions::ListSessions, {}, &listed).ok());
  ASSERT_THAT(listed.sessions(), SizeIs(1));
  EXPECT_EQ(listed.sessions(0).scene().sheets(0).triangles().asset(), name);
  a.reset();
  EXPECT_EQ(insist(*b, session).scene().sheets(0).triangles().asset(), name);
  b->step(session, 1);
  expect_equal(frames(*b, session, 10), before);
  b->erase(session);
  EXPECT_EQ(delete_asset(*b->assets, name).code, grpc::StatusCode::OK);
}

}  // namespace
}  // namespace weft::testing

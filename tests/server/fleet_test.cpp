#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <future>
#include <pqxx/pqxx>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "server/store/assets.h"
#include "server/store/postgres_connection.h"
#include "server/store/records.h"
#include "server/store/store.h"
#include "tests/support/service/assets.h"
#include "tests/support/service/postgres.h"
#include "tests/support/service/process.h"
#include "tests/support/service/service.h"
#include "tests/support/temporary_directory.h"

// libpqxx 6.4 loses the answer to what it sends on a connection that turns out to be broken.
extern "C" const char* __lsan_default_suppressions();
const char* __lsan_default_suppressions() { return "leak:libpqxx"; }

namespace weft::testing {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using Sessions = Service::Sessions;
using std::chrono::milliseconds, std::chrono::seconds;

// weftd in a process of its own, which can be killed and frozen.
class Replica {
 public:
  Replica(const std::string& database, const std::string& name) {
    process_.emplace("weftd",
                     std::vector<std::string>{"--port=0", "--database=" + database,
                                              "--replica=" + name, "--metrics=none"},
                     output_.path("weftd.txt"));
    const std::string listening = "weftd listening on ";
    std::string text;
    while (text.find(listening) == std::string::npos || !text.ends_with('\n')) {
      std::this_thread::sleep_for(milliseconds(2));
      std::ostringstream all;
      all << std::ifstream(output_.path("weftd.txt")).rdbuf();
      text = all.str();
    }
    const std::size_t begin = text.find(listening) + listening.size();
    const std::string address = text.substr(begin, text.find('\n', begin) - begin);
    sessions_ = v1::SessionService::NewStub(
        grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  }

  template <class Request, class Response>
  grpc::Status call(grpc::Status (Sessions::*method)(grpc::ClientContext*, const Request&,
                                                     Response*),
                    const Request& request, Response* response,
                    seconds longest = seconds(60)) const {
    grpc::ClientContext context;
    context.set_wait_for_ready(true);
    context.set_deadline(std::chrono::system_clock::now() + longest);
    return (sessions_.get()->*method)(&context, request, response);
  }

  v1::Session create(const std::string& id) const {
    v1::CreateSessionRequest request;
    request.set_session_id(id);
    *request.mutable_session()->mutable_scene() = small_scene();
    v1::Session session;
    EXPECT_TRUE(call(&Sessions::CreateSession, request, &session).ok());
    return session;
  }
  void step(const v1::Session& session, std::int64_t frames) const {
    v1::StepSessionRequest request;
    request.set_name(session.name());
    request.set_frames(frames);
    v1::StepSessionResponse response;
    EXPECT_TRUE(call(&Sessions::StepSession, request, &response).ok());
  }

  void kill() {
    process_->signal(SIGKILL);
    process_->wait();
    process_.reset();
  }
  void freeze() const { process_->signal(SIGSTOP); }
  void thaw() const { process_->signal(SIGCONT); }

 private:
  TemporaryDirectory output_;
  std::optional<Process> process_;
  std::unique_ptr<v1::SessionService::Stub> sessions_;
};

// Servers that share a database.
class Fleet : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!Postgres::is_installed()) GTEST_SKIP() << "no PostgreSQL";
    database_ = std::make_unique<Postgres>();
  }

  ServerOptions options(const std::string& name) const {
    ServerOptions options = Service::in_process();
    options.database = database_->url();
    options.replica = name;
    options.snapshot_ms = snapshot_ms_;
    return options;
  }
  std::unique_ptr<Service> server(const std::string& name) const {
    return std::make_unique<Service>(options(name));
  }
  Replica replica(const std::string& name) const { return {database_->url(), name}; }

  static Error get_error(Service& service, const v1::Session& session) {
    v1::GetSessionRequest request;
    request.set_name(session.name());
    return service.error(&Sessions::GetSession, request);
  }
  // Asks until the server has taken the session over, and is where the other one was.
  static v1::Session insist(Service& service, const v1::Session& session) {
    const auto ask_later = [] { std::this_thread::sleep_for(milliseconds(5)); };
    while (get_error(service, session).reason() == "WRONG_REPLICA") ask_later();
    while (service.get(session).state() == v1::SESSION_STATE_RESTORING) ask_later();
    return service.get(session);
  }

  static void set_preset(Service& service, const v1::Session& session, const std::string& preset) {
    v1::UpdateTextileRequest request;
    request.set_name(session.name());
    request.mutable_textile()->set_preset(preset);
    ASSERT_EQ(service.error(&Sessions::UpdateTextile, request).code, grpc::StatusCode::OK);
  }

  static std::vector<v1::Frame> frames(Service& service, const v1::Session& session,
                                       std::int64_t last, std::int64_t first = 0) {
    return Stream(service, frames_of(session, first, last)).rest();
  }
  static void expect_equal(const std::vector<v1::Frame>& found,
                           const std::vector<v1::Frame>& wanted) {
    ASSERT_EQ(found.size(), wanted.size());
    for (std::size_t i = 0; i < found.size(); ++i)
      ASSERT_TRUE(found[i].SerializeAsString() == wanted[i].SerializeAsString()) << "frame " << i;
  }
  // Of a session of its own that nothing disturbed.
  static std::vector<v1::Frame> undisturbed(Service& service, std::int64_t last) {
    const v1::Session session = service.create();
    service.step(session, last);
    return frames(service, session, last);
  }

  std::int64_t count(const std::string& query) const {
    pqxx::connection connection(database_->url());
    pqxx::work transaction(connection);
    return transaction.exec1(query)[0].as<std::int64_t>();
  }
  void change(const std::string& statement) const {
    pqxx::connection connection(database_->url());
    pqxx::work transaction(connection);
    transaction.exec(statement);
    transaction.commit();
  }

  int snapshot_ms_ = 2000;
  std::unique_ptr<Postgres> database_;
};

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
  while (b->info().sessions() == 0) std::this_thread::sleep_for(milliseconds(5));
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

// Where it hangs is chance: here, where it has locked a session and not said what becomes of it.
TEST_F(Fleet, TakesASessionFromAServerThatHangsInATransaction) {
  Replica a = replica("a");
  const auto b = server("b");
  const v1::Session session = a.create("curtain");
  a.step(session, 5);

  PostgresConnection of_a(database_->url());
  of_a.run([](pqxx::work&) {});
  std::promise<void> locked, taken;
  int times = 0;
  std::jthread hanging([&] {
    of_a.run([&](pqxx::work& transaction) {
      transaction.exec("UPDATE weft.session SET epoch = epoch");
      if (++times > 1) return;
      locked.set_value();
      taken.get_future().wait();
      transaction.exec("UPDATE weft.session SET epoch = epoch");
    });
  });
  locked.get_future().wait();
  a.kill();
  EXPECT_EQ(insist(*b, session).frame(), 5);
  taken.set_value();
  hanging.join();
  EXPECT_EQ(times, 2) << "done again on another connection";
  b->step(session, 5);
  expect_equal(frames(*b, session, 10), undisturbed(*b, 10));
}

TEST_F(Fleet, GoesOnWithOtherSessionsWhileOneIsLocked) {
  Replica a = replica("a");
  const auto b = server("b");
  const v1::Session locked = a.create("curtain"), other = a.create("flag");
  pqxx::connection stranger(database_->url());
  auto lock = std::make_unique<pqxx::work>(stranger);
  lock->exec("UPDATE weft.session SET epoch = epoch WHERE id = 'curtain'");
  a.kill();
  const Error error = get_error(*b, locked);
  EXPECT_EQ(error.reason(), "STORE_UNREACHABLE");
  EXPECT_THAT(error.message, HasSubstr("lock timeout"));
  EXPECT_EQ(insist(*b, other).replica(), "b");
  lock->abort();
  while (get_error(*b, locked).reason() == "STORE_UNREACHABLE") {
  }
  EXPECT_EQ(insist(*b, locked).replica(), "b");
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
  while (a.info().sessions() > 0) std::this_thread::sleep_for(milliseconds(5));
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

TEST_F(Fleet, MovesNoSessionWhenAServerComesOrTheDatabaseIsRestarted) {
  const auto a = server("a"), b = server("b");
  for (int i = 0; i < 5; ++i) a->create();
  const auto c = server("c");
  database_->restart();
  const auto asked = [&] {
    v1::Session nobodys;
    nobodys.set_name("sessions/nobodys");
    return get_error(*c, nobodys).code;
  };
  while (asked() != grpc::StatusCode::NOT_FOUND) std::this_thread::sleep_for(milliseconds(5));
  std::this_thread::sleep_for(seconds(4));  // longer than a lease
  EXPECT_EQ(a->info().sessions(), 5);
  EXPECT_EQ(b->info().sessions() + c->info().sessions(), 0);
}

TEST_F(Fleet, SimulatesOnAndLetsChangesWaitWhileTheDatabaseIsAway) {
  const auto a = server("a");
  const v1::Session session = a->create(), other = a->create();
  Stream stream(*a, frames_of(session));
  v1::RunSessionRequest run;
  run.set_name(session.name());
  run.set_time_scale(1);
  ASSERT_EQ(a->error(&Sessions::RunSession, run).code, grpc::StatusCode::OK);
  while (stream.frame().number() < 60) {  // the log then knows its pace
  }
  database_->stop();
  const std::int64_t stopped = a->get(session).frame();
  while (stream.frame().number() < stopped + 20) {
  }
  v1::Session nobodys;
  nobodys.set_name("sessions/nobodys");
  EXPECT_EQ(get_error(*a, nobodys).reason(), "STORE_UNREACHABLE");
  std::jthread caller([&] { set_preset(*a, other, "denim_11oz"); });
  database_->start();
  caller.join();
  EXPECT_EQ(count("SELECT count(*) FROM weft.entry"), 2);
}

TEST_F(Fleet, RefusesWhatTheDatabaseRefusesAndGoesOn) {
  const auto a = server("a");
  const v1::Session session = a->create();
  change("ALTER TABLE weft.entry ADD CHECK (false) NOT VALID");
  v1::StepSessionRequest step;
  step.set_name(session.name());
  const Error error = a->error(&Sessions::StepSession, step);
  EXPECT_EQ(error.reason(), "STORE_UNWRITABLE") << error.message;
  change("ALTER TABLE weft.entry DROP CONSTRAINT entry_check");
  a->step(session, 3);
  EXPECT_EQ(count("SELECT max(number) FROM weft.entry"), 0);
}

TEST_F(Fleet, NamesASessionWhoseDataIsDamaged) {
  auto a = server("a");
  const v1::Session session = a->create();
  a->step(session, 3);
  a.reset();
  change("UPDATE weft.entry SET checksum = checksum + 1");
  const auto b = server("b");
  while (get_error(*b, session).reason() == "WRONG_REPLICA") std::this_thread::yield();
  EXPECT_EQ(get_error(*b, session).code, grpc::StatusCode::DATA_LOSS);
  b->erase(session);
  EXPECT_EQ(get_error(*b, session).code, grpc::StatusCode::NOT_FOUND);
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

TEST_F(Fleet, OpensADatabaseThatHadNoAssets) {
  auto a = server("a");
  const v1::Session session = a->create();
  a.reset();
  change("DROP TABLE weft.asset_use, weft.asset_piece, weft.asset");
  change("UPDATE weft.version SET number = 1");
  const auto b = server("b");
  EXPECT_EQ(insist(*b, session).uid(), session.uid());
  EXPECT_EQ(upload(*b->assets, square_mesh(2).SerializeAsString()).second.code,
            grpc::StatusCode::OK);
}

TEST_F(Fleet, SaysWhatIsWrongWithADatabase) {
  const auto refusal = [](const std::string& url) {
    try {
      open_postgres_store(url, "a")->load();
    } catch (const StoreError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(refusal("postgres:/nowhere"), HasSubstr("names no PostgreSQL database"));
  const std::string away = refusal("host=/nowhere dbname=weft password=secret");
  EXPECT_THAT(away, HasSubstr("PostgreSQL at /nowhere:5432/weft cannot be reached"));
  EXPECT_THAT(away, ::testing::Not(HasSubstr("secret")));
  server("a").reset();
  change("UPDATE weft.version SET number = 99");
  EXPECT_THAT(refusal(database_->url()), HasSubstr("version 99"));
}

}  // namespace
}  // namespace weft::testing

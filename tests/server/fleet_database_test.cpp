#include <chrono>
#include <future>
#include <memory>
#include <pqxx/pqxx>
#include <string>
#include <thread>

#include "server/store/postgres_connection.h"
#include "server/store/store.h"
#include "tests/server/fleet_support.h"
#include "tests/support/service/assets.h"

namespace weft::testing {
namespace {

using ::testing::HasSubstr;
using Sessions = Service::Sessions;
using std::chrono::seconds;

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
  const Error error = get_error_when_left(*b, locked);
  EXPECT_EQ(error.reason(), "STORE_UNREACHABLE");
  EXPECT_THAT(error.message, HasSubstr("lock timeout"));
  EXPECT_EQ(insist(*b, other).replica(), "b");
  lock->abort();
  while (get_error(*b, locked).reason() == "STORE_UNREACHABLE") {
  }
  EXPECT_EQ(insist(*b, locked).replica(), "b");
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
  while (asked() != grpc::StatusCode::NOT_FOUND) ask_later();
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
  EXPECT_EQ(get_error_when_left(*b, session).code, grpc::StatusCode::DATA_LOSS);
  b->erase(session);
  EXPECT_EQ(get_error(*b, session).code, grpc::StatusCode::NOT_FOUND);
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

#pragma once

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <pqxx/pqxx>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/service/postgres.h"
#include "tests/support/service/process.h"
#include "tests/support/service/service.h"
#include "tests/support/temporary_directory.h"

namespace weft::testing {

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
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
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
  grpc::Status call(grpc::Status (Service::Sessions::*method)(grpc::ClientContext*, const Request&,
                                                              Response*),
                    const Request& request, Response* response,
                    std::chrono::seconds longest = std::chrono::seconds(60)) const {
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
    EXPECT_TRUE(call(&Service::Sessions::CreateSession, request, &session).ok());
    return session;
  }
  void step(const v1::Session& session, std::int64_t frames) const {
    v1::StepSessionRequest request;
    request.set_name(session.name());
    request.set_frames(frames);
    v1::StepSessionResponse response;
    EXPECT_TRUE(call(&Service::Sessions::StepSession, request, &response).ok());
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
    return service.error(&Service::Sessions::GetSession, request);
  }
  static void ask_later() { std::this_thread::sleep_for(std::chrono::milliseconds(5)); }
  // Asks until no other server holds the session: the database learns a moment late who died.
  static Error get_error_when_left(Service& service, const v1::Session& session) {
    Error error = get_error(service, session);
    for (; error.reason() == "WRONG_REPLICA"; error = get_error(service, session)) ask_later();
    return error;
  }
  // Asks until the server has taken the session over, and is where the other one was.
  static v1::Session insist(Service& service, const v1::Session& session) {
    get_error_when_left(service, session);
    while (service.get(session).state() == v1::SESSION_STATE_RESTORING) ask_later();
    return service.get(session);
  }

  static void set_preset(Service& service, const v1::Session& session, const std::string& preset) {
    v1::UpdateTextileRequest request;
    request.set_name(session.name());
    request.mutable_textile()->set_preset(preset);
    ASSERT_EQ(service.error(&Service::Sessions::UpdateTextile, request).code, grpc::StatusCode::OK);
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

}  // namespace weft::testing

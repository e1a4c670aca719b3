#include "client/connection.h"

#include <fmt/format.h>

#include "server/server.h"

namespace weft::client {
namespace {

std::shared_ptr<grpc::Channel> open_channel(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);  // the server bounds what it sends
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 1000);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 2000);
  // a peer that died without a word
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 15'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

}  // namespace

class Connection::Embedded {
 public:
  std::shared_ptr<grpc::Channel> channel() { return server_.in_process_channel(); }

 private:
  static ServerOptions without_address() {
    ServerOptions options;
    options.host.reset();
    return options;
  }

  Server server_{without_address()};
};

std::unique_ptr<Connection> Connection::to(const std::string& address, std::stop_token stop) {
  return std::unique_ptr<Connection>(
      new Connection(nullptr, address, open_channel(address), std::move(stop)));
}

std::unique_ptr<Connection> Connection::embedded(std::stop_token stop) {
  auto server = std::make_unique<Embedded>();
  const auto channel = server->channel();
  return std::unique_ptr<Connection>(
      new Connection(std::move(server), "the embedded server", channel, std::move(stop)));
}

Connection::Connection(std::unique_ptr<Embedded> server, std::string address,
                       const std::shared_ptr<grpc::Channel>& channel, std::stop_token stop)
    : embedded_(std::move(server)),
      address_(std::move(address)),
      stop_(std::move(stop)),
      stubs_(v1::SessionService::NewStub(channel), v1::FrameService::NewStub(channel),
             v1::TextileService::NewStub(channel), v1::ServerService::NewStub(channel),
             v1::LabService::NewStub(channel)) {}

Connection::~Connection() = default;

v1::Session Connection::get_session(const std::string& name) {
  v1::GetSessionRequest request;
  request.set_name(name);
  return call(&v1::SessionService::Stub::GetSession, request);
}

void Connection::check(const grpc::Status& status) const {
  if (status.ok()) return;
  if (stop_.stop_requested()) throw interrupted();
  Problem problem = server_problem(status);
  if (problem.exit != Exit::kNoConnection) throw problem;
  throw Problem(
      problem.exit, problem.code, problem.reason,
      fmt::format("no connection to {} ({}); start weftd, or name its address with --server",
                  address_, problem.what()));
}

}  // namespace weft::client

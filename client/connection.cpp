#include "client/connection.h"

#include <fmt/format.h>
#include <grpcpp/generic/generic_stub.h>

#include <chrono>
#include <string_view>

#include "server/server.h"

namespace weft::client {
namespace {

std::shared_ptr<grpc::Channel> open_channel(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);                   // the server bounds what it sends
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // a socket for each connection
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
  auto server = std::make_shared<Embedded>();
  const auto channel = server->channel();
  return std::unique_ptr<Connection>(
      new Connection(std::move(server), "the embedded server", channel, std::move(stop)));
}

std::unique_ptr<Connection> Connection::another() const {
  const auto channel = embedded_ ? embedded_->channel() : open_channel(address_);
  return std::unique_ptr<Connection>(new Connection(embedded_, address_, channel, stop_));
}

Connection::Connection(std::shared_ptr<Embedded> server, std::string address,
                       std::shared_ptr<grpc::Channel> channel, std::stop_token stop)
    : embedded_(std::move(server)),
      address_(std::move(address)),
      stop_(std::move(stop)),
      channel_(std::move(channel)),
      stubs_(v1::SessionService::NewStub(channel_), v1::FrameService::NewStub(channel_),
             v1::TextileService::NewStub(channel_), v1::ServerService::NewStub(channel_),
             v1::LabService::NewStub(channel_)) {}

Connection::~Connection() = default;

v1::Session Connection::get_session(const std::string& name) {
  v1::GetSessionRequest request;
  request.set_name(name);
  return call(&v1::SessionService::Stub::GetSession, request);
}

bool Connection::is_serving() {
  grpc::GenericStub stub(channel_);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(2));
  const std::stop_callback cancel(stop_, [&] { context.TryCancel(); });
  grpc::CompletionQueue queue;
  const grpc::Slice whole_server;  // an empty HealthCheckRequest
  const auto call = stub.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check",
                                          grpc::ByteBuffer(&whole_server, 1), &queue);
  call->StartCall();
  grpc::ByteBuffer response;
  grpc::Status status;
  call->Finish(&response, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  check(status);
  grpc::Slice bytes;
  response.DumpToSingleSlice(&bytes);
  constexpr std::string_view kServing = "\x08\x01";  // HealthCheckResponse{status: SERVING}
  return std::string_view(reinterpret_cast<const char*>(bytes.begin()), bytes.size()) == kServing;
}

void Connection::await_server(std::chrono::milliseconds longest) {
  channel_->WaitForConnected(std::chrono::system_clock::now() + longest);
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

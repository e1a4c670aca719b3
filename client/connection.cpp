#include "client/connection.h"

#include <fmt/format.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/client_interceptor.h>

#include <algorithm>
#include <chrono>
#include <string_view>
#include <utility>
#include <vector>

#include "client/input_file.h"
#include "server/config.h"
#include "server/pem.h"
#include "server/server.h"

namespace weft::client {
namespace {

// Adds the token to every call; gRPC's own way to do so wants TLS on loopback too.
class TokenSender final : public grpc::experimental::Interceptor {
 public:
  explicit TokenSender(std::string value) : value_(std::move(value)) {}

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    using Hook = grpc::experimental::InterceptionHookPoints;
    if (methods->QueryInterceptionHookPoint(Hook::PRE_SEND_INITIAL_METADATA))
      methods->GetSendInitialMetadata()->emplace("authorization", value_);
    methods->Proceed();
  }

 private:
  const std::string value_;
};

class TokenSenders final : public grpc::experimental::ClientInterceptorFactoryInterface {
 public:
  explicit TokenSenders(const std::string& token) : value_("Bearer " + token) {}

  grpc::experimental::Interceptor* CreateClientInterceptor(
      grpc::experimental::ClientRpcInfo*) override {
    return new TokenSender(value_);
  }

 private:
  const std::string value_;
};

grpc::ChannelArguments channel_arguments() {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);                   // the server bounds what it sends
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // a socket for each connection
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 1000);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 2000);
  // a peer that died without a word
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 15'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  return arguments;
}

std::shared_ptr<grpc::ChannelCredentials> channel_credentials(const Credentials& given) {
  if (given.tls_cert.empty() != given.tls_key.empty())
    throw usage_problem("--tls-cert and --tls-key go together");
  if (given.tls_ca.empty() && !given.tls_cert.empty())
    throw usage_problem("--tls-cert needs --tls-ca: the server's certificate is to be known");
  if (given.tls_ca.empty()) return grpc::InsecureChannelCredentials();
  try {
    grpc::SslCredentialsOptions options;
    options.pem_root_certs = read_certificates(given.tls_ca);
    if (!given.tls_cert.empty()) {
      KeyPair pair = read_key_pair(given.tls_cert, given.tls_key);
      options.pem_cert_chain = std::move(pair.certificates);
      options.pem_private_key = std::move(pair.key);
    }
    return grpc::SslCredentials(options);
  } catch (const std::runtime_error& error) {
    throw Problem(Exit::kFile, "INVALID_ARGUMENT", "FILE_UNREADABLE", error.what());
  }
}

std::string token_of(const Credentials& given, const std::string& address) {
  std::string token = given.token_file.empty() ? given.token : read_text(given.token_file);
  token.erase(token.find_last_not_of(" \t\r\n") + 1);
  const bool printable =
      std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c <= '~'; });
  if (!printable || (token.empty() && !given.token_file.empty())) {
    throw malformed(given.token_file.empty() ? "WEFT_TOKEN" : given.token_file,
                    "is no token: a word of printable ASCII characters");
  }
  const bool here =
      address.starts_with("unix:") || is_loopback(address.substr(0, address.rfind(':')));
  if (!token.empty() && given.tls_ca.empty() && !here) {
    throw usage_problem("a token would leave this machine unencrypted for " + address +
                        "; give --tls-ca");
  }
  return token;
}

// "Connection refused" of gRPC's chain of causes, which lie behind colons.
std::string_view cause_of(std::string_view text) {
  const std::size_t colon = text.rfind(": ");
  return colon == std::string_view::npos ? text : text.substr(colon + 2);
}

}  // namespace

// Opens channels to one server.
class Connection::Dialer {
 public:
  Dialer(std::string address, const Credentials& given)
      : address_(std::move(address)),
        credentials_(channel_credentials(given)),
        has_tls_(!given.tls_ca.empty()),
        has_certificate_(!given.tls_cert.empty()),
        token_(token_of(given, address_)) {}

  std::shared_ptr<grpc::Channel> channel() const {
    std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>>
        interceptors;
    if (!token_.empty()) interceptors.push_back(std::make_unique<TokenSenders>(token_));
    return grpc::experimental::CreateCustomChannelWithInterceptors(
        address_, credentials_, channel_arguments(), std::move(interceptors));
  }

  // What may help where there is no connection, by gRPC's words for it.
  std::string advice(const std::string& text) const {
    const auto says = [&](const char* words) { return text.find(words) != std::string::npos; };
    if (says("handshake failed") || says("is not in peer certificate"))
      return "its certificate is not signed by --tls-ca, or for another host, or it speaks no TLS";
    if (says("Socket closed") && !has_tls_) return "does the server want TLS? give --tls-ca";
    if (says("Socket closed") && !has_certificate_)
      return "does the server want a certificate? give --tls-cert and --tls-key";
    if (says("Socket closed")) return "the server may not take this certificate";
    return "start weftd, or name its address with --server";
  }

 private:
  const std::string address_;
  const std::shared_ptr<grpc::ChannelCredentials> credentials_;
  const bool has_tls_, has_certificate_;
  const std::string token_;
};

class Connection::Embedded {
 public:
  std::shared_ptr<grpc::Channel> channel() { return server_.in_process_channel(); }

 private:
  static ServerOptions without_address() {
    ServerOptions options;
    options.host.reset();
    // nobody else waits for it
    options.limits.max_frame_work = std::numeric_limits<std::int64_t>::max();
    return options;
  }

  Server server_{without_address()};
};

std::unique_ptr<Connection> Connection::to(const std::string& address, std::stop_token stop,
                                           const Credentials& credentials) {
  auto dialer = std::make_shared<const Dialer>(address, credentials);
  const auto channel = dialer->channel();
  return std::unique_ptr<Connection>(
      new Connection(nullptr, std::move(dialer), address, channel, std::move(stop)));
}

std::unique_ptr<Connection> Connection::embedded(std::stop_token stop) {
  auto server = std::make_shared<Embedded>();
  const auto channel = server->channel();
  return std::unique_ptr<Connection>(
      new Connection(std::move(server), nullptr, "the embedded server", channel, std::move(stop)));
}

std::unique_ptr<Connection> Connection::another(std::stop_token stop) const {
  const auto channel = embedded_ ? embedded_->channel() : dialer_->channel();
  return std::unique_ptr<Connection>(
      new Connection(embedded_, dialer_, address_, channel, std::move(stop)));
}

Connection::Connection(std::shared_ptr<Embedded> server, std::shared_ptr<const Dialer> dialer,
                       std::string address, std::shared_ptr<grpc::Channel> channel,
                       std::stop_token stop)
    : embedded_(std::move(server)),
      dialer_(std::move(dialer)),
      address_(std::move(address)),
      stop_(std::move(stop)),
      channel_(std::move(channel)),
      stubs_(v1::SessionService::NewStub(channel_), v1::FrameService::NewStub(channel_),
             v1::TextileService::NewStub(channel_), v1::ServerService::NewStub(channel_),
             v1::LabService::NewStub(channel_), v1::AssetService::NewStub(channel_),
             v1::GarmentService::NewStub(channel_)) {}

Connection::~Connection() = default;

v1::Session Connection::get_session(const std::string& name) {
  v1::GetSessionRequest request;
  request.set_name(name);
  return call(&v1::SessionService::Stub::GetSession, request);
}

void Connection::relax(const std::string& session) {
  v1::ApplyActionsRequest request;
  request.set_name(session);
  request.add_actions()->mutable_relax();
  call(&v1::SessionService::Stub::ApplyActions, request);
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

bool Connection::is_open() const { return channel_->GetState(false) == GRPC_CHANNEL_READY; }

void Connection::check(const grpc::Status& status) const {
  if (status.ok()) return;
  if (stop_.stop_requested()) throw interrupted();
  Problem problem = server_problem(status);
  if (problem.exit != Exit::kNoConnection) throw problem;
  throw Problem(problem.exit, problem.code, problem.reason,
                fmt::format("no connection to {} ({}); {}", address_, cause_of(problem.what()),
                            dialer_ ? dialer_->advice(problem.what()) : "it has stopped"));
}

}  // namespace weft::client

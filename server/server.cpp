#include "server/server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <functional>
#include <limits>
#include <mutex>
#include <stdexcept>

#include "server/batch_threads.h"
#include "server/rpc/asset_service.h"
#include "server/rpc/assets.h"
#include "server/rpc/backend.h"
#include "server/rpc/find.h"
#include "server/rpc/frame_service.h"
#include "server/rpc/garment_service.h"
#include "server/rpc/lab_service.h"
#include "server/rpc/metrics.h"
#include "server/rpc/restore.h"
#include "server/rpc/server_service.h"
#include "server/rpc/session_service.h"
#include "server/rpc/textile_service.h"

namespace weft {
namespace {

constexpr std::array kServices = {"",
                                  "weft.v1.AssetService",
                                  "weft.v1.SessionService",
                                  "weft.v1.FrameService",
                                  "weft.v1.ServerService",
                                  "weft.v1.TextileService",
                                  "weft.v1.LabService",
                                  "weft.v1.GarmentService"};

// For calls that are answered at once, when gRPC is shut down.
constexpr std::chrono::milliseconds kGrace{200}, kNoGrace{0};

void set_transport(grpc::ServerBuilder& builder, const Limits& limits) {
  using std::chrono::milliseconds, std::chrono::seconds;
  const auto ms = [](milliseconds time) { return static_cast<int>(time.count()); };
  builder.SetMaxReceiveMessageSize(static_cast<int>(limits.max_request_bytes));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, 1024);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT,
                             0);  // a second server does not share the port
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, ms(seconds(30)));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, ms(seconds(10)));
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS,
                             ms(seconds(10)));
}

void enable_plugins() {
  static const bool once = [] {
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    return true;
  }();
  static_cast<void>(once);
}

std::string replica_of(const ServerOptions& options) {
  if (options.replica) return *options.replica;
  std::array<char, 64> name{};
  gethostname(name.data(), name.size() - 1);
  for (char& c : name) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    if (c != '\0' && !((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'))) c = '-';
  }
  return name.data();
}

std::unique_ptr<SessionStore> open_store(const ServerOptions& options) {
  if (options.database) return open_postgres_store(*options.database, replica_of(options));
  return options.data_dir ? open_sqlite_store(*options.data_dir) : make_no_store();
}

// Until it is told to stop.
void repeat(const std::stop_token& stop, std::chrono::milliseconds period,
            const std::function<void()>& work) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  while (!stop.stop_requested()) {
    never.wait_for(lock, stop, period, [] { return false; });
    if (!stop.stop_requested()) work();
  }
}

constexpr std::chrono::minutes kLongestSweep{10};  // between two
constexpr std::chrono::seconds kTrimInterval{1};

void sweep(Backend& backend, std::chrono::milliseconds ttl) try {
  sweep_assets(backend, std::chrono::system_clock::now() - ttl);
} catch (const StoreError& error) {
  spdlog::warn("assets that nothing uses stay: {}", error.what());
}

// Sessions that compute nothing keep more than their share when others come.
void trim_histories(Backend& backend) {
  if (!backend.history->exceeded()) return;
  for (const auto& session : backend.registry.list("", std::numeric_limits<std::size_t>::max()))
    session->trim_history();
}

}  // namespace

struct Server::Parts {
  explicit Parts(const ServerOptions& options)
      : backend(options.limits, options.worker_threads,
                std::chrono::milliseconds(options.snapshot_ms), open_store(options),
                options.database ? replica_of(options) : "",
                Access(options.tokens, options.tls && options.tls->client_ca)),
        assets(backend, options.upload_patience) {}

  Backend backend;
  AssetService assets;
  SessionService sessions{backend};
  FrameService frames{backend};
  ServerService server{backend};
  TextileService textiles{backend.access};
  LabService lab{backend};
  GarmentService garments{backend};
  std::unique_ptr<grpc::Server> grpc;
  std::optional<Metrics> metrics;
  std::jthread eviction, sweeping, trimming;
  bool stopped = false;
};

Server::Server(const ServerOptions& options) : parts_(std::make_unique<Parts>(options)) {
  restore_sessions(parts_->backend);
  std::optional<BatchThreads> of_calls(std::in_place);
  enable_plugins();
  grpc::ServerBuilder builder;
  set_transport(builder, options.limits);
  builder.RegisterService(&parts_->assets);
  builder.RegisterService(&parts_->sessions);
  builder.RegisterService(&parts_->frames);
  builder.RegisterService(&parts_->server);
  builder.RegisterService(&parts_->textiles);
  builder.RegisterService(&parts_->lab);
  builder.RegisterService(&parts_->garments);
  int port = 0;
  if (options.host) {
    builder.AddListeningPort(*options.host + ":" + std::to_string(options.port),
                             make_credentials(options.tls), &port);
  }
  parts_->grpc = builder.BuildAndStart();
  of_calls.reset();
  if (!parts_->grpc || (options.host && port == 0)) {
    throw std::runtime_error("cannot listen on " + options.host.value_or("") + ":" +
                             std::to_string(options.port) +
                             ": is the port taken, or the address another machine's?");
  }
  if (options.host) address_ = *options.host + ":" + std::to_string(port);
  if (options.metrics) parts_->metrics.emplace(parts_->backend, *options.metrics);
  parts_->backend.store->watch(
      {[backend = &parts_->backend](const std::string& uid) {
         if (const auto session = backend->registry.find_uid(uid)) give_away(*backend, session);
       },
       [backend = &parts_->backend](const std::string& id) { adopt_session(*backend, id); }});
  if (options.idle.count() > 0 && (options.database || options.data_dir))
    parts_->eviction = std::jthread(
        repeat, options.idle / 8,
        [backend = &parts_->backend, idle = options.idle] { evict_sessions(*backend, idle); });
  if (options.asset_ttl.count() > 0)
    parts_->sweeping = std::jthread(
        repeat, std::min<std::chrono::milliseconds>(options.asset_ttl / 8, kLongestSweep),
        [backend = &parts_->backend, ttl = options.asset_ttl] { sweep(*backend, ttl); });
  parts_->trimming = std::jthread(repeat, kTrimInterval,
                                  [backend = &parts_->backend] { trim_histories(*backend); });
  for (const char* service : kServices) {
    parts_->grpc->GetHealthCheckService()->SetServingStatus(service, true);
  }
}

Server::~Server() {
  stop();
  // the scenes that they are at still need the services
  parts_->backend.planner.stop();
  parts_->backend.large_planner.stop();
  parts_->backend.garments.stop();
  parts_->backend.store_calls.stop();
  parts_->backend.asset_calls.stop();
  parts_->backend.scheduler.stop();  // and sessions the store
}

std::string Server::metrics_address() const {
  return parts_->metrics ? parts_->metrics->address() : "";
}

bool Server::answers(std::chrono::milliseconds time) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + time);
  v1::ServerStats stats;
  const auto status =
      v1::ServerService::NewStub(in_process_channel())->GetServerStats(&context, {}, &stats);
  return status.error_code() != grpc::StatusCode::DEADLINE_EXCEEDED;  // a refusal is an answer
}

std::shared_ptr<grpc::Channel> Server::in_process_channel() {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  return parts_->grpc->InProcessChannel(arguments);
}

void Server::stop(std::chrono::milliseconds deadline) {
  if (!parts_->grpc || std::exchange(parts_->stopped, true)) return;
  parts_->grpc->GetHealthCheckService()->Shutdown();  // NOT_SERVING
  parts_->backend.draining = true;
  parts_->eviction.request_stop();
  parts_->sweeping.request_stop();

  // end every call ourselves, and let the answers leave: gRPC would wait for ever, or drop them
  const auto end = Clock::now() + deadline;
  parts_->frames.drain();
  parts_->assets.drain();
  parts_->backend.registry.close(Refusal::Why::kDraining);
  parts_->sessions.drain();
  parts_->backend.planner.drain();
  parts_->backend.large_planner.drain();
  parts_->backend.garments.drain();
  parts_->backend.store_calls.drain();
  parts_->backend.asset_calls.drain();
  parts_->lab.drain();
  const bool ended = parts_->backend.calls.wait_for_none(end);
  parts_->grpc->Shutdown(std::chrono::system_clock::now() + (ended ? kGrace : kNoGrace));
  parts_->backend.store->leave();  // last: a database may be slow
}

}  // namespace weft

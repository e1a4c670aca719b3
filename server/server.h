#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "server/credentials.h"
#include "server/session/limits.h"

namespace weft {

struct ServerOptions {
  std::optional<std::string> host = "127.0.0.1";  // absent: reached by in_process_channel() only
  int port = 0;                                   // 0: a free one
  int worker_threads = static_cast<int>(std::thread::hardware_concurrency());
  std::optional<std::string> metrics;   // "127.0.0.1:9464"; absent: none
  std::optional<std::string> data_dir;  // where sessions are kept; absent: they end with the server
  std::optional<std::string> database;  // of PostgreSQL, which several servers share; instead
  std::optional<std::string> replica;   // what those call this one; absent: the host's name
  std::optional<ServerTls> tls;         // absent: unencrypted
  std::optional<std::string> tokens;    // file of Access; absent: nobody needs one
  int snapshot_ms = 2000;               // SessionHost::snapshot_after
  std::chrono::milliseconds idle = std::chrono::hours(1);  // evict_sessions(); 0: never
  // Assets that no session names are deleted after so long; 0: never.
  std::chrono::milliseconds asset_ttl = std::chrono::hours(24);
  std::chrono::milliseconds upload_patience = std::chrono::minutes(1);  // without a message
  Limits limits;
};

// A running textile service.
class Server {
 public:
  // Serves once constructed, with the sessions that were kept. Throws std::runtime_error where the
  // address, the data directory or a file cannot be had.
  explicit Server(const ServerOptions& options);
  ~Server();  // stops

  const std::string& address() const { return address_; }  // "127.0.0.1:41234"; empty without host
  std::string metrics_address() const;                     // empty without metrics

  // Whether a call comes back within the time.
  bool answers(std::chrono::milliseconds time);

  // A channel without a network.
  std::shared_ptr<grpc::Channel> in_process_channel();

  // Reports NOT_SERVING, creates no session any more, ends every stream and waiting call with
  // SERVER_DRAINING, and stops serving; calls still under way after `deadline` are cancelled.
  // Frames being computed are finished by the destructor. Calling it again does nothing.
  void stop(std::chrono::milliseconds deadline = std::chrono::seconds(2));

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  std::string address_;
};

}  // namespace weft

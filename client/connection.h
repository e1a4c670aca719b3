#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <stop_token>
#include <string>
#include <tuple>

#include "client/attempts.h"
#include "client/problem.h"
#include "weft/v1/asset.grpc.pb.h"
#include "weft/v1/frame.grpc.pb.h"
#include "weft/v1/garment.grpc.pb.h"
#include "weft/v1/lab.grpc.pb.h"
#include "weft/v1/server.grpc.pb.h"
#include "weft/v1/session.grpc.pb.h"
#include "weft/v1/textile.grpc.pb.h"

namespace weft::client {

inline constexpr const char* kDefaultServer = "127.0.0.1:7311";

// What a server is shown, and how it is known. Files are in PEM; an empty name is none.
struct Credentials {
  std::string tls_ca;             // certificates, one of which signed the server's; none: no TLS
  std::string tls_cert, tls_key;  // our own
  std::string token_file;         // says who we are
  std::string token;              // the same; the file goes before
};

// A server to talk to: one that listens somewhere, or one of our own within this process.
class Connection {
 public:
  // A request to stop cancels every call. Throws a Problem where a file cannot be used, or a token
  // would leave this machine unencrypted.
  static std::unique_ptr<Connection> to(const std::string& address, std::stop_token stop,
                                        const Credentials& credentials = {});
  static std::unique_ptr<Connection> embedded(std::stop_token stop);
  // One more to the same server, for more calls than one carries.
  std::unique_ptr<Connection> another() const { return another(stop_); }
  std::unique_ptr<Connection> another(std::stop_token stop) const;
  ~Connection();

  // The answer, or a Problem. A call that may be repeated is, see Attempts; one that changes
  // something is named for that.
  template <class Stub, class Request, class Response>
  Response call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                const Request& request) {
    return call(method, request, stop_);
  }
  // The same, cancelled by another stop; an empty token: by none.
  template <class Stub, class Request, class Response>
  Response call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                Request request, const std::stop_token& stop) {
    name_call(request);
    Attempts attempts(*this, request, kPatience, stop);
    for (;;) {
      grpc::ClientContext context;
      attempts.address(context);
      const std::stop_callback cancel(stop, [&] { context.TryCancel(); });
      Response response;
      const grpc::Status status =
          (std::get<std::unique_ptr<Stub>>(stubs_).get()->*method)(&context, request, &response);
      if (status.ok()) {
        attempts.note_message();
        return response;
      }
      attempts.go_on_after(status);
    }
  }

  v1::Session get_session(const std::string& name);  // "sessions/flag"
  void relax(const std::string& session);            // see weft.v1.Relax
  // Whether the server takes calls, as its gRPC health service says.
  bool is_serving();
  v1::SessionService::Stub& sessions() {
    return *std::get<std::unique_ptr<v1::SessionService::Stub>>(stubs_);
  }
  v1::FrameService::Stub& frames() {
    return *std::get<std::unique_ptr<v1::FrameService::Stub>>(stubs_);
  }
  v1::LabService::Stub& lab() { return *std::get<std::unique_ptr<v1::LabService::Stub>>(stubs_); }
  v1::AssetService::Stub& assets() {
    return *std::get<std::unique_ptr<v1::AssetService::Stub>>(stubs_);
  }
  const std::stop_token& stop() const { return stop_; }

  // Waits until the server can be reached, at most so long. Between calls nobody works on that.
  void await_server(std::chrono::milliseconds longest);
  // Whether there is a connection now; whether weftd ever answered.
  bool is_open() const;
  bool was_reached() const { return was_reached_; }
  void note_answer() { was_reached_ = true; }

  // Throws what is wrong, if anything.
  void check(const grpc::Status& status) const;

 private:
  class Embedded;
  class Dialer;
  Connection(std::shared_ptr<Embedded> server, std::shared_ptr<const Dialer> dialer,
             std::string address, std::shared_ptr<grpc::Channel> channel, std::stop_token stop);

  std::shared_ptr<Embedded> embedded_;  // or
  std::shared_ptr<const Dialer> dialer_;
  std::string address_;
  std::stop_token stop_;
  std::atomic<bool> was_reached_ = false;
  std::shared_ptr<grpc::Channel> channel_;
  std::tuple<std::unique_ptr<v1::SessionService::Stub>, std::unique_ptr<v1::FrameService::Stub>,
             std::unique_ptr<v1::TextileService::Stub>, std::unique_ptr<v1::ServerService::Stub>,
             std::unique_ptr<v1::LabService::Stub>, std::unique_ptr<v1::AssetService::Stub>,
             std::unique_ptr<v1::GarmentService::Stub>>
      stubs_;
};

}  // namespace weft::client

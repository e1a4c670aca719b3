#pragma once

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "google/rpc/error_details.pb.h"
#include "server/server.h"
#include "weft/v1/asset.grpc.pb.h"
#include "weft/v1/frame.grpc.pb.h"
#include "weft/v1/server.grpc.pb.h"
#include "weft/v1/session.grpc.pb.h"

namespace weft::testing {

// A hung sheet of 4 x 5 particles, the paper's textile.
v1::Scene small_scene();

// One whose solver diverges after a few frames.
v1::Scene diverging_scene();

// An error with its details.
struct Error {
  grpc::StatusCode code = grpc::StatusCode::OK;
  std::string message;
  google::rpc::ErrorInfo info;
  google::rpc::BadRequest bad;
  google::rpc::ResourceInfo resource;
  google::rpc::QuotaFailure quota;
  bool retry = false;

  explicit Error(const grpc::Status& status);
  std::string reason() const { return info.reason(); }
  std::string metadata(const std::string& key) const;
  std::vector<std::string> fields() const;
};

// A server within the test and stubs to call it. Methods that return no status expect success.
class Service {
 public:
  using Sessions = v1::SessionService::Stub;

  explicit Service(ServerOptions options = in_process());
  static ServerOptions in_process();

  template <class Request, class Response>
  grpc::Status call(grpc::Status (Sessions::*method)(grpc::ClientContext*, const Request&,
                                                     Response*),
                    const Request& request, Response* response) {
    grpc::ClientContext context;
    return (sessions.get()->*method)(&context, request, response);
  }

  // The error, or the absence of one, that a call ends with.
  template <class Request, class Response>
  Error error(grpc::Status (Sessions::*method)(grpc::ClientContext*, const Request&, Response*),
              const Request& request) {
    Response response;
    return Error(call(method, request, &response));
  }

  v1::Session create(const v1::Scene& scene = small_scene(), const std::string& id = {});
  Error create_error(const v1::Scene& scene, const std::string& id = {});
  v1::Session get(const v1::Session& session);
  v1::StepSessionResponse step(const v1::Session& session, std::int64_t count = 1);
  v1::RunSessionResponse run(const v1::Session& session, std::int64_t until_frame);
  v1::PauseSessionResponse pause(const v1::Session& session);
  void erase(const v1::Session& session);
  v1::ServerInfo info();

  Server server;
  std::shared_ptr<grpc::Channel> channel = server.in_process_channel();
  std::unique_ptr<v1::SessionService::Stub> sessions = v1::SessionService::NewStub(channel);
  std::unique_ptr<v1::FrameService::Stub> frames = v1::FrameService::NewStub(channel);
  std::unique_ptr<v1::ServerService::Stub> servers = v1::ServerService::NewStub(channel);
  std::unique_ptr<v1::AssetService::Stub> assets = v1::AssetService::NewStub(channel);
};

// A call of StreamFrames.
class Stream {
 public:
  Stream(Service& service, const v1::StreamFramesRequest& request);
  ~Stream();  // cancels

  std::optional<v1::StreamFramesResponse> read();  // nullopt: the stream has ended
  v1::StreamHeader header();                       // expects it to come next
  v1::Frame frame();                               // skips everything else
  std::vector<v1::Frame> rest();                   // all frames until the end
  Error finish();                                  // reads to the end
  void cancel() { context_.TryCancel(); }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::StreamFramesResponse>> reader_;
};

// A call by bytes alone: what a method answers first, and its error. A stream is cancelled then.
std::pair<std::string, Error> raw_call(Service& service, const std::string& method,
                                       const std::string& request, bool streams = false,
                                       const std::string& token = {});

// The bytes with one bit flipped, cut short, or with a byte more. Precondition: not empty.
std::string damaged(std::string bytes, std::mt19937& random);

// Every method of the interface, from its descriptors.
std::vector<const google::protobuf::MethodDescriptor*> all_methods();

// What an HTTP server answers to GET /metrics.
std::string metrics_at(const std::string& address);

// From `start` on, to `end` where it is not below 0.
v1::StreamFramesRequest frames_of(const v1::Session& session, std::int64_t start = 0,
                                  std::int64_t end = -1);

}  // namespace weft::testing

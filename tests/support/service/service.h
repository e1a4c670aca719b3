#pragma once

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "google/rpc/error_details.pb.h"
#include "server/server.h"
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

// A server within the test and stubs to call it. Methods that are not about errors expect none.
class Service {
 public:
  explicit Service(ServerOptions options = in_process());
  static ServerOptions in_process();

  v1::Session create(const v1::Scene& scene = small_scene(), const std::string& id = {});
  grpc::Status try_create(const v1::Scene& scene, const std::string& id = {},
                          v1::Session* created = nullptr);
  v1::Session get(const std::string& name);
  v1::StepSessionResponse step(const std::string& name, std::int64_t count = 1);
  grpc::Status try_step(const v1::StepSessionRequest& request);
  v1::RunSessionResponse run(const std::string& name, std::int64_t until_frame);
  void erase(const std::string& name);

  Server server;
  std::shared_ptr<grpc::Channel> channel = server.in_process_channel();
  std::unique_ptr<v1::SessionService::Stub> sessions = v1::SessionService::NewStub(channel);
  std::unique_ptr<v1::FrameService::Stub> frames = v1::FrameService::NewStub(channel);
  std::unique_ptr<v1::ServerService::Stub> servers = v1::ServerService::NewStub(channel);
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
  grpc::Status finish();                           // reads to the end
  void cancel() { context_.TryCancel(); }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::StreamFramesResponse>> reader_;
};

// From `start` on, to `end` where it is not below 0.
v1::StreamFramesRequest frames_of(const v1::Session& session, std::int64_t start = 0,
                                  std::int64_t end = -1);

}  // namespace weft::testing

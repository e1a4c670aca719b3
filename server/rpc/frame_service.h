#pragma once

#include <memory>

#include "server/rpc/frame_stream.h"
#include "server/rpc/frame_streams.h"
#include "server/rpc/frame_view.h"
#include "weft/v1/frame.grpc.pb.h"

namespace weft {

// Requests and frames pass as bytes: frames are encoded once for all streams.
class FrameService final
    : public v1::FrameService::WithRawCallbackMethod_StreamFrames<
          v1::FrameService::WithRawCallbackMethod_ViewFrames<v1::FrameService::Service>> {
 public:
  explicit FrameService(Backend& backend) : backend_(backend), streams_(backend.stats) {}

  void drain() { streams_.drain(); }

  grpc::ServerWriteReactor<grpc::ByteBuffer>* StreamFrames(
      grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) override {
    const auto stream = std::make_shared<FrameStream>(backend_, streams_);
    stream->start(*context, *request);
    return stream.get();
  }

  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* ViewFrames(
      grpc::CallbackServerContext* context) override {
    const auto view = std::make_shared<FrameView>(backend_, streams_);
    view->start(*context);
    return view.get();
  }

 private:
  Backend& backend_;
  FrameStreams streams_;
};

}  // namespace weft

#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <deque>

#include "server/rpc/frame_call.h"

namespace weft {

// One call of StreamFrames.
class FrameStream final : public grpc::ServerWriteReactor<grpc::ByteBuffer>, public FrameCall {
 public:
  using FrameCall::FrameCall;

  // Called once, first.
  void start(const grpc::ServerContextBase& context, const grpc::ByteBuffer& request);

  void OnWriteDone(bool ok) override { on_write_done(ok); }
  void OnCancel() override { on_cancel(); }
  void OnDone() override { on_done(); }

 private:
  grpc::Status open() override;
  bool do_first() override;
  std::vector<grpc::ByteBuffer> messages_of(const Reading& reading) override;
  void start_write(const grpc::ByteBuffer* message) override { StartWrite(message); }
  void finish_call(const grpc::Status& status) override { Finish(status); }

  v1::StreamFramesRequest request_;
  std::deque<Repair> repairs_;  // of the last frame, still to be written
};

}  // namespace weft

#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include "server/rpc/frame_call.h"

namespace weft {

// One call of ViewFrames. Without a credit it does nothing but wait for one.
class FrameView final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                        public FrameCall {
 public:
  using FrameCall::FrameCall;

  // Called once, first.
  void start(const grpc::ServerContextBase& context);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override { on_write_done(ok); }
  void OnCancel() override { on_cancel(); }
  void OnDone() override { on_done(); }

 private:
  void take(const v1::ViewFramesRequest& request);
  grpc::Status open() override;
  bool do_first() override;
  bool wants_frame() const override { return credits_ > 0; }
  std::vector<grpc::ByteBuffer> messages_of(const Reading& reading) override;
  void start_write(const grpc::ByteBuffer* message) override { StartWrite(message); }
  void finish_call(const grpc::Status& status) override { Finish(status); }

  grpc::ByteBuffer request_;
  int credits_ = 0;       // open
  bool no_more_ = false;  // of the client's messages will come
};

}  // namespace weft

#pragma once

#include <grpcpp/support/server_callback.h>

#include <functional>
#include <utility>

#include "server/rpc/open_calls.h"

namespace weft {

// Finishes a unary call at once.
inline grpc::ServerUnaryReactor* answer(grpc::CallbackServerContext* context,
                                        const grpc::Status& status) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(status);
  return reactor;
}

// A unary call that is finished later, from another thread. Deletes itself when it is done.
class UnaryCall final : public grpc::ServerUnaryReactor {
 public:
  explicit UnaryCall(OpenCalls& calls, std::function<void()> on_cancel = {})
      : ticket_(calls), on_cancel_(std::move(on_cancel)) {}

  void OnCancel() override {
    if (on_cancel_) on_cancel_();
  }
  void OnDone() override { delete this; }

 private:
  OpenCalls::Ticket ticket_;
  std::function<void()> on_cancel_;
};

}  // namespace weft

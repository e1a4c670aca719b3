#pragma once

#include <grpcpp/support/server_callback.h>

#include <functional>
#include <mutex>
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
  explicit UnaryCall(OpenCalls& calls) : ticket_(calls) {}

  // At once where it is cancelled already.
  void when_cancelled(std::function<void()> react) {
    {
      std::lock_guard lock(mutex_);
      if (!cancelled_) {
        react_ = std::move(react);
        return;
      }
    }
    react();
  }

  void OnCancel() override {
    std::function<void()> react;
    {
      std::lock_guard lock(mutex_);
      cancelled_ = true;
      react.swap(react_);
    }
    if (react) react();
  }
  void OnDone() override { delete this; }

 private:
  OpenCalls::Ticket ticket_;
  std::mutex mutex_;  // guards all below
  bool cancelled_ = false;
  std::function<void()> react_;
};

}  // namespace weft

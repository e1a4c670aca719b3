#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <vector>

#include "server/rpc/backend.h"
#include "server/rpc/find.h"
#include "weft/v1/session.pb.h"

namespace weft {

class Interaction;

// The open calls of Interact. Thread-safe.
class Interactions {
 public:
  // Why the call is not one of them.
  grpc::Status add(const std::shared_ptr<Interaction>& interaction);
  void remove(const std::shared_ptr<Interaction>& interaction);
  // Ends every call, and adds none any more.
  void drain();

 private:
  std::mutex mutex_;
  std::set<std::shared_ptr<Interaction>> interactions_;
  bool draining_ = false;
};

// One call of Interact: a hand. One batch of actions at a time is with the session; what comes
// meanwhile waits for its answer to have left, newer drags in the place of older ones. Lives until
// OnDone.
class Interaction final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                          public std::enable_shared_from_this<Interaction> {
 public:
  Interaction(Backend& backend, Interactions& interactions)
      : backend_(backend), interactions_(interactions), ticket_(backend.calls) {}

  // Called once, first.
  void start(const grpc::ServerContextBase& context);
  // Ends the call with SERVER_DRAINING.
  void drain();

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  // Actions that are not done yet, and the latest message among them.
  struct Batch {
    std::vector<Action> actions;
    std::int64_t sequence = 0;
  };
  static constexpr std::size_t kMostWaiting = 64;  // actions; then no message is read

  void act(std::unique_lock<std::mutex>& lock);
  void submit(std::unique_lock<std::mutex>& lock, std::vector<Action> actions, Done done);
  // with the mutex held
  void begin(const v1::InteractRequest& first);
  void begin(const FoundSession& found, const v1::InteractRequest& first);
  grpc::Status take(const v1::InteractRequest& request);
  void read();
  void end(const grpc::Status& status);
  void let_go(std::unique_lock<std::mutex>& lock);

  Backend& backend_;
  Interactions& interactions_;
  OpenCalls::Ticket ticket_;
  std::shared_ptr<Interaction> self_;  // until OnDone

  std::mutex mutex_;  // guards all below
  StreamCaller caller_;
  grpc::ByteBuffer request_, response_;
  std::shared_ptr<Session> session_;
  int hand_ = 0;
  std::int64_t sequence_ = 0;  // of the latest message
  Batch waiting_;
  bool reading_ = false;  // or the session of the first message is looked for
  bool busy_ = false;     // a batch is with the session, or its answer on the way
  bool holds_ = false;    // it may have grabbed something
  bool letting_ = false;  // it lets go, and is then finished
  std::optional<grpc::Status> ending_;
};

}  // namespace weft

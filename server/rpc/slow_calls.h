#pragma once

#include <grpcpp/support/status.h>

#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>

#include "server/session/scheduler.h"

namespace weft {

// Calls whose work takes its time, done one after the other on a thread of its own. Thread-safe.
class SlowCalls {
 public:
  // `subject` and `complaint` are for those who ask when too many wait.
  SlowCalls(std::string subject, std::string complaint)
      : subject_(std::move(subject)), complaint_(std::move(complaint)) {}

  using Work = std::function<grpc::Status()>;
  // Called once, from any thread.
  using Then = std::function<void(const grpc::Status&)>;

  // Answers with what the work comes to, or why it is not done. The work may outlive the call.
  void ask(Work work, Then then);

  // Answers every call, also those to come, with SERVER_DRAINING.
  void drain();
  // Lets the work under way end.
  void stop() { thread_.stop(); }

 private:
  class Call;
  void end(const std::shared_ptr<Call>& call, const grpc::Status& status);

  const std::string subject_, complaint_;
  std::mutex mutex_;                       // guards all below
  std::set<std::shared_ptr<Call>> calls_;  // that are not answered
  bool draining_ = false;
  Scheduler thread_{1};
};

}  // namespace weft

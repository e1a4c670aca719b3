#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "server/rpc/backend.h"
#include "weft/v1/lab.grpc.pb.h"

namespace weft {

// Tests of textiles, one after the other on a thread of their own: neither sessions nor their
// creation wait for them.
class LabService final : public v1::LabService::CallbackService {
 public:
  explicit LabService(Backend& backend) : backend_(backend) {}

  grpc::ServerWriteReactor<v1::RunTestResponse>* RunTest(
      grpc::CallbackServerContext* context, const v1::RunTestRequest* request) override;

  // Ends every test, and begins none any more.
  void drain();

 private:
  class Run;
  grpc::Status admit(const std::shared_ptr<Run>& run);  // or why not

  Backend& backend_;
  std::mutex mutex_;
  std::vector<std::weak_ptr<Run>> runs_;  // guarded by mutex_
  bool draining_ = false;                 // guarded by mutex_
  Scheduler bench_{1};                    // goes first: what it runs is stopped by then
};

}  // namespace weft

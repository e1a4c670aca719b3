#include "server/rpc/lab_service.h"

#include <new>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <variant>

#include "core/lab/lab.h"
#include "server/convert/convert.h"
#include "server/rpc/errors.h"

namespace weft {

// One call of RunTest. It has one message in flight and at most one that waits: newer progress
// takes the place of older. gRPC holds it until OnDone, the bench until its test has ended.
class LabService::Run final : public grpc::ServerWriteReactor<v1::RunTestResponse>,
                              public std::enable_shared_from_this<Run> {
 public:
  explicit Run(OpenCalls& calls) : ticket_(std::in_place, calls) {}

  // Called once, first.
  void hold() { self_ = shared_from_this(); }

  void tell_progress(int done, int specimens) {
    v1::RunTestResponse message;
    message.mutable_progress()->set_done(done);
    message.mutable_progress()->set_specimens(specimens);
    tell(std::move(message));
  }

  // The test itself, on the bench.
  void compute(const LabOrder& order) {
    const LabWatch watch{stop_.get_token(),
                         [this](int done, int specimens) { tell_progress(done, specimens); }};
    try {
      const LabReport report = run_lab(order, watch);
      if (watch.stop.stop_requested()) return;  // ended by then
      v1::RunTestResponse message;
      *message.mutable_report() = to_proto(order, report);
      tell(std::move(message));
      end(grpc::Status::OK);
    } catch (const std::bad_alloc&) {
      end(errors::exhausted("memory", "the server has no memory for this test", true));
    }
  }

  // Ends the call as soon as nothing is in flight, with OK after what waits; and the test.
  void end(const grpc::Status& status) {
    stop_.request_stop();
    std::lock_guard lock(mutex_);
    if (!ending_) ending_ = status;
    write_on();
  }

  void OnWriteDone(bool ok) override {
    if (!ok) stop_.request_stop();
    std::lock_guard lock(mutex_);
    writing_ = false;
    if (!ok) ending_ = errors::cancelled();
    write_on();
  }
  void OnCancel() override { end(errors::cancelled()); }
  void OnDone() override {
    const auto self = std::move(self_);
    ticket_.reset();
  }

 private:
  void tell(v1::RunTestResponse message) {
    std::lock_guard lock(mutex_);
    next_ = std::move(message);
    write_on();
  }

  // With the mutex held.
  void write_on() {
    if (writing_ || finished_) return;
    if (next_ && (!ending_ || ending_->ok())) {
      message_ = std::move(*next_);
      next_.reset();
      writing_ = true;
      StartWrite(&message_);
    } else if (ending_) {
      finished_ = true;
      Finish(*ending_);
    }
  }

  std::optional<OpenCalls::Ticket> ticket_;  // until OnDone
  std::shared_ptr<Run> self_;                // until OnDone
  std::stop_source stop_;

  std::mutex mutex_;  // guards all below
  v1::RunTestResponse message_;
  std::optional<v1::RunTestResponse> next_;
  bool writing_ = false;
  bool finished_ = false;
  std::optional<grpc::Status> ending_;
};

grpc::Status LabService::admit(const std::shared_ptr<Run>& run) {
  std::lock_guard lock(mutex_);
  if (draining_) return errors::server_draining();
  std::erase_if(runs_, [](const auto& other) { return other.expired(); });
  const auto most = static_cast<std::size_t>(backend_.limits.max_tests);
  if (runs_.size() >= most)
    return errors::exhausted(
        "tests", "the server has " + std::to_string(most) + " tests to run, its most", true);
  runs_.push_back(run);
  return grpc::Status::OK;
}

void LabService::drain() {
  std::vector<std::weak_ptr<Run>> runs;
  {
    std::lock_guard lock(mutex_);
    draining_ = true;
    runs.swap(runs_);
  }
  // the one that runs last, so that none begins in its place
  for (auto weak = runs.rbegin(); weak != runs.rend(); ++weak)
    if (const auto run = weak->lock()) run->end(errors::server_draining());
}

grpc::ServerWriteReactor<v1::RunTestResponse>* LabService::RunTest(
    grpc::CallbackServerContext* context, const v1::RunTestRequest* request) {
  const auto run = std::make_shared<Run>(backend_.calls);
  run->hold();
  const auto caller = backend_.access.caller(*context);
  const auto order = to_lab_order(*request);
  if (const auto* error = std::get_if<grpc::Status>(&caller)) {
    run->end(*error);
  } else if (const auto* problems = std::get_if<std::vector<Problem>>(&order)) {
    run->end(errors::field_invalid(*problems));
  } else if (const grpc::Status refused = admit(run); !refused.ok()) {
    run->end(refused);
  } else {
    run->tell_progress(0, 0);
    if (!bench_.post([run, what = std::get<LabOrder>(order)] { run->compute(what); }))
      run->end(errors::exhausted("tests", "too many tests wait", true));
  }
  return run.get();
}

}  // namespace weft

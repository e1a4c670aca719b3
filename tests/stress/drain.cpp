#include <fmt/format.h>
#include <google/rpc/error_details.pb.h>
#include <google/rpc/status.pb.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <vector>

#include "client/output/text.h"
#include "client/scene_file.h"
#include "client/templates/templates.h"
#include "tests/stress/stress.h"
#include "tests/stress/weftd.h"

namespace weft::stress {
namespace {

using Clock = std::chrono::steady_clock;

// Counts down to 0.
class Countdown {
 public:
  explicit Countdown(int count) : count_(count) {}
  void step() {
    const std::lock_guard lock(mutex_);
    if (--count_ == 0) changed_.notify_all();
  }
  // False where it takes longer than that.
  bool wait(std::chrono::seconds longest) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, longest, [&] { return count_ <= 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int count_;
};

// Reads a stream to its end.
class Reader : public grpc::ClientReadReactor<v1::StreamFramesResponse> {
 public:
  Reader(client::Connection& connection, const std::string& session, Countdown& begun,
         Countdown& ended)
      : begun_(begun), ended_(ended) {
    request_.set_session(session);
    request_.set_start_frame(1);
    connection.frames().async()->StreamFrames(&context_, &request_, this);
    StartRead(&message_);
    StartCall();
  }

  void OnReadDone(bool ok) override {
    if (!ok) return;
    if (message_.has_frame()) {
      last_frame_ = message_.frame().number();
      if (last_frame_ == 1) begun_.step();
    }
    StartRead(&message_);
  }

  void OnDone(const grpc::Status& status) override {
    status_ = status;
    ended_.step();
  }

  // Whether it ended as drained, behind the frame that the server says was its last.
  bool drained() const {
    google::rpc::Status details;
    details.ParseFromString(status_.error_details());
    google::rpc::ErrorInfo info;
    for (const auto& detail : details.details()) detail.UnpackTo(&info);
    const auto last = info.metadata().find("last_frame");
    return info.reason() == "SERVER_DRAINING" && last != info.metadata().end() &&
           last->second == std::to_string(last_frame_);
  }

 private:
  Countdown& begun_;
  Countdown& ended_;
  grpc::ClientContext context_;
  v1::StreamFramesRequest request_;
  v1::StreamFramesResponse message_;
  grpc::Status status_;
  std::int64_t last_frame_ = 0;
};

}  // namespace

Outcome drain(Form form) {
  constexpr double kLongest = 3;  // s
  constexpr int kStreamsEach = 5;
  const int sessions = form == Form::kShort ? 20 : 100;
  const int streams = sessions * kStreamsEach;
  Weftd weftd;
  const auto connection = weftd.connect();
  const v1::Scene scene = client::make_template("hang");
  Countdown begun(streams), ended(streams);
  std::vector<std::unique_ptr<Reader>> readers;
  for (int i = 0; i < sessions; ++i) {
    v1::RunSessionRequest run;
    run.set_name(client::create_session(*connection, scene).name());
    run.set_time_scale(0.5);
    for (int k = 0; k < kStreamsEach; ++k)
      readers.push_back(std::make_unique<Reader>(*connection, run.name(), begun, ended));
    connection->call(&v1::SessionService::Stub::RunSession, run);
  }
  if (!begun.wait(std::chrono::seconds(60))) throw std::runtime_error("streams bring no frames");

  const auto start = Clock::now();
  const int exit = weftd.terminate();
  const std::chrono::duration<double> took = Clock::now() - start;
  if (!ended.wait(std::chrono::seconds(60))) throw std::runtime_error("streams do not end");
  int drained = 0;
  for (const auto& reader : readers) drained += reader->drained() ? 1 : 0;
  return {
      .figure = fmt::format("{} sessions, {} of {} streams ended as drained after their last "
                            "frame, {}, exit code {}",
                            sessions, drained, streams, client::seconds_text(took.count()), exit),
      .hold = "all, 3 s, 0",
      .counts = drained == streams && exit == 0,
      .bounds = took.count() <= kLongest};
}

}  // namespace weft::stress

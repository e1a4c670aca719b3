#include <fmt/format.h>

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <set>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "client/load/load.h"
#include "client/output/text.h"
#include "client/templates/templates.h"
#include "tests/stress/stress.h"
#include "tests/stress/weftd.h"

namespace weft::stress {
namespace {

// A client whose stream is opened and never read, beyond the 64 kB that gRPC takes on its own.
class DeadReader {
 public:
  DeadReader(const std::string& address, const std::string& session) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
    arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 65536);
    stub_ = v1::FrameService::NewStub(
        grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments));
    v1::StreamFramesRequest request;
    request.set_session(session);
    reader_ = stub_->StreamFrames(&context_, request);
  }
  ~DeadReader() {
    context_.TryCancel();
    reader_->Finish();
  }

 private:
  std::unique_ptr<v1::FrameService::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::StreamFramesResponse>> reader_;
};

// Dead readers, so many of each session as soon as it is there.
std::vector<std::unique_ptr<DeadReader>> watch_without_reading(const Weftd& weftd, int readers,
                                                               const std::stop_token& stop) {
  const auto connection = weftd.connect();
  std::vector<std::unique_ptr<DeadReader>> dead;
  std::set<std::string> seen;
  while (!stop.stop_requested()) {
    const auto list =
        connection->call(&v1::SessionService::Stub::ListSessions, v1::ListSessionsRequest());
    for (const v1::Session& session : list.sessions()) {
      if (!seen.insert(session.name()).second) continue;
      for (int i = 0; i < readers; ++i)
        dead.push_back(std::make_unique<DeadReader>(weftd.address(), session.name()));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return dead;
}

struct Watched {
  client::LoadResult result;
  Usage usage;
};

// A load that does not take the whole machine, and so many dead readers of each session beside it,
// which have come to a stand when the ramp ends.
Watched watch(Form form, int readers) {
  const Weftd weftd({"--max-streams", "2000"});
  const auto connection = weftd.connect();
  client::LoadOrder order{.scene = client::make_template("hang"), .sessions = 10};
  order.subscribers = 10;
  order.rate_per_s = 30;
  order.ramp = std::chrono::seconds(3);
  order.duration = std::chrono::seconds(form == Form::kShort ? 4 : 60);
  Watched watched;
  std::stop_source stop;
  auto dead = std::async(std::launch::async, watch_without_reading, std::ref(weftd), readers,
                         stop.get_token());
  watched.result = client::apply_load(*connection, order);
  watched.usage = weftd.usage();
  stop.request_stop();
  dead.get();
  return watched;
}

}  // namespace

// 100 who read and 100 who do not: those who do must not notice.
Outcome slow_readers(Form form) {
  constexpr double kMostSlower = 0.1;
  constexpr std::int64_t kMostMemory = 32'000'000;
  const Watched calm = watch(form, 0);
  const Watched beside = watch(form, 10);
  const double before = calm.result.frame.quantile(0.99),
               after = beside.result.frame.quantile(0.99);
  const std::int64_t memory = beside.usage.most_memory - calm.usage.most_memory;
  const bool clean = calm.result.clean() && beside.result.clean();
  return {.figure = fmt::format("100 readers: {} of {} frames, {} lost, {} doubled, {} errors; p99 "
                                "lateness {}, with 100 dead ones {} ({:+.1f} %), {} more memory",
                                beside.result.frames_received, beside.result.frames_due,
                                beside.result.frames_lost, beside.result.frames_doubled,
                                beside.result.error_count(), client::seconds_text(before),
                                client::seconds_text(after), 100 * (after / before - 1),
                                client::bytes_text(memory)),
          .hold = "0, 0, 0; +10 %, +32 MB",
          .counts = clean && beside.result.frames_received > 0,
          .bounds = after <= before * (1 + kMostSlower) && memory <= kMostMemory};
}

}  // namespace weft::stress

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <future>
#include <map>
#include <mutex>
#include <thread>

#include "client/output/text.h"
#include "client/scene_file.h"
#include "client/templates/templates.h"
#include "tests/stress/stress.h"
#include "tests/stress/weftd.h"

namespace weft::stress {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr std::chrono::milliseconds kDrawing{200};

// When each frame came to a reader that is never late.
class Arrivals {
 public:
  Arrivals(client::Connection& connection, const std::string& session) {
    v1::StreamFramesRequest request;
    request.set_session(session);
    request.set_start_frame(0);
    stream_ = connection.frames().StreamFrames(&context_, request);
    thread_ = std::jthread([this] {
      for (v1::StreamFramesResponse message; stream_->Read(&message);) {
        const std::lock_guard lock(mutex_);
        if (message.has_frame()) times_[message.frame().number()] = Clock::now();
      }
    });
  }
  ~Arrivals() {
    context_.TryCancel();
    thread_.join();
    stream_->Finish();
  }

  Seconds age(std::int64_t frame) const {
    const std::lock_guard lock(mutex_);
    const auto found = times_.find(frame);
    return found == times_.end() ? Seconds(0) : Clock::now() - found->second;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::int64_t, Clock::time_point> times_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::StreamFramesResponse>> stream_;
  std::jthread thread_;
};

struct ViewCounts {
  int frames = 0;
  int wrong = 0;           // frames where the numbers and the skipped ones do not add up
  Seconds greatest_age{};  // when it is drawn
};

// Draws five frames a second, and grants a credit as soon as it has one to draw.
ViewCounts view(client::Connection& connection, const Arrivals& arrivals,
                const std::string& session, int window, std::chrono::seconds duration) {
  grpc::ClientContext context;
  const auto stream = connection.frames().ViewFrames(&context);
  v1::ViewFramesRequest request;
  request.set_session(session);
  request.set_credits(window);
  ViewCounts seen;
  std::int64_t next = -1;
  const auto end = Clock::now() + duration;
  bool open = stream->Write(request);
  v1::ViewFramesRequest credit;
  credit.set_credits(1);
  for (v1::ViewFramesResponse message; open && Clock::now() < end && stream->Read(&message);) {
    if (message.has_header()) next = message.header().start_frame();
    if (!message.has_frame()) continue;
    ++seen.frames;
    if (message.frame().number() != next + message.skipped_count()) ++seen.wrong;
    next = message.frame().number() + 1;
    seen.greatest_age = std::max(seen.greatest_age, arrivals.age(message.frame().number()));
    open = stream->Write(credit);
    std::this_thread::sleep_for(kDrawing);
  }
  context.TryCancel();
  stream->Finish();
  return seen;
}

}  // namespace

// Those who draw 5 of 30 frames a second see what is there, not what was.
Outcome view_age(Form form) {
  constexpr std::array kWindows{1, 2, 4};
  const std::chrono::seconds duration(form == Form::kShort ? 3 : 60);
  const Weftd weftd;
  const auto connection = weftd.connect();
  v1::RunSessionRequest run;
  run.set_name(client::create_session(*connection, client::make_template("hang")).name());
  run.set_time_scale(0.5);
  connection->call(&v1::SessionService::Stub::RunSession, run);
  const Arrivals arrivals(*connection, run.name());
  std::vector<std::future<ViewCounts>> views;
  for (const int window : kWindows) {
    views.push_back(std::async(std::launch::async, [&, window] {
      return view(*connection, arrivals, run.name(), window, duration);
    }));
  }
  Outcome outcome{.figure = "5 of 30 frames/s:", .hold = "(window + 1) x 200 ms + 50 ms"};
  for (std::size_t i = 0; i < kWindows.size(); ++i) {
    const ViewCounts seen = views[i].get();
    const Seconds most = (kWindows[i] + 1) * kDrawing + std::chrono::milliseconds(50);
    outcome.figure += fmt::format("{} window {}: {} frames, at most {} old, {} miscounted",
                                  i == 0 ? "" : ";", kWindows[i], seen.frames,
                                  client::seconds_text(seen.greatest_age.count()), seen.wrong);
    outcome.counts = outcome.counts && seen.wrong == 0 && seen.frames > 0;
    outcome.bounds = outcome.bounds && seen.greatest_age <= most;
  }
  return outcome;
}

}  // namespace weft::stress

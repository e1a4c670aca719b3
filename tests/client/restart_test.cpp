#include <gmock/gmock.h>
#include <signal.h>

#include <atomic>
#include <filesystem>
#include <future>
#include <mutex>
#include <random>
#include <thread>
#include <vector>

#include "client/recording/reader.h"
#include "tests/client/client_test.h"
#include "tests/support/service/process.h"

namespace weft::testing {
namespace {

using ::testing::HasSubstr;
using Sessions = v1::SessionService::Stub;

// A loopback address of this process, so that a port stays free while weftd is gone.
std::string own_host() {
  const auto pid = static_cast<unsigned>(getpid());
  return "127." + std::to_string(1 + (pid >> 16) % 250) + "." + std::to_string((pid >> 8) & 255) +
         "." + std::to_string(1 + (pid & 255) % 250);
}

// weftd with sessions on disk, which is killed and started again.
class RestartedWeftd : public ClientTest {
 protected:
  void start(std::size_t file_size_limit = 0) {
    weftd_ = std::make_unique<Process>(
        "weftd",
        std::vector<std::string>{"--host", host_, "--port", port_, "--data-dir", path("data"),
                                 "--snapshot-ms", "5", "--log-level", "off"},
        path("weftd.txt"), file_size_limit);
    std::string line;
    while (line.find('\n') == std::string::npos) {
      line = read_file(path("weftd.txt"));
      std::this_thread::yield();
    }
    line.resize(line.find('\n'));
    port_ = line.substr(line.rfind(':') + 1);
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 10);
    arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 50);
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    const auto channel =
        grpc::CreateCustomChannel(address(), grpc::InsecureChannelCredentials(), arguments);
    std::lock_guard lock(mutex_);
    stub_ = v1::SessionService::NewStub(channel);
  }
  void kill_and_start() {
    weftd_->signal(SIGKILL);
    weftd_->wait();
    start();
  }
  std::string address() const { return host_ + ":" + port_; }

  // Records the session "cloth" into cloth.weft. When this returns, the recorder has its
  // connection: a command that finds no server when it starts gives up.
  std::future<Outcome> record_until(std::int64_t last) const {
    auto recorded = std::async(std::launch::async, [this, last] {
      return run_weft({"record", "cloth", "--from", "0", "--to", std::to_string(last), "--encoding",
                       "float64", "-o", path("cloth.weft"), "--server", address(), "--json"});
    });
    while (!std::filesystem::exists(path("cloth.weft")) &&
           recorded.wait_for(std::chrono::milliseconds(1)) == std::future_status::timeout) {
    }
    return recorded;
  }

  std::shared_ptr<Sessions> stub() {
    std::lock_guard lock(mutex_);
    return stub_;
  }

  const std::string host_ = own_host();
  std::string port_ = "0";
  std::unique_ptr<Process> weftd_;
  std::mutex mutex_;
  std::shared_ptr<Sessions> stub_;  // guarded by mutex_
};

// Sends the call until it is answered, through kills and while a run is under way; `stub` gives the
// connection there is.
template <class Request, class Response>
Response insist(const auto& stub,
                grpc::Status (Sessions::*method)(grpc::ClientContext*, const Request&, Response*),
                const Request& request) {
  for (;;) {
    grpc::ClientContext context;
    Response response;
    const grpc::Status status = ((*stub()).*method)(&context, request, &response);
    if (status.ok()) return response;
    const bool again = status.error_code() == grpc::StatusCode::UNAVAILABLE ||
                       status.error_code() == grpc::StatusCode::UNKNOWN ||
                       Error(status).reason() == "SESSION_RUNNING";
    if (!again) {
      ADD_FAILURE() << status.error_message();
      return response;
    }
    std::this_thread::yield();
  }
}

// One call of a random history.
struct Call {
  enum class Kind { kStep, kRun, kTextile, kDrag, kGrab } kind;
  std::int64_t frames = 0;
  double bend = 0;
};

std::vector<Call> make_history(int calls, std::mt19937& random) {
  std::vector<Call> history{{Call::Kind::kGrab}};
  for (int i = 0; i < calls; ++i) {
    const auto kind = static_cast<Call::Kind>(random() % 4);
    history.push_back({kind, static_cast<std::int64_t>(1 + random() % 60),
                       1e-6 * static_cast<double>(1 + random() % 20)});
  }
  history.push_back({Call::Kind::kStep, 1, 0});  // waits for a run
  return history;
}

std::int64_t last_frame(const std::vector<Call>& history) {
  std::int64_t frame = 0;
  for (const Call& call : history) {
    if (call.kind == Call::Kind::kStep || call.kind == Call::Kind::kRun) frame += call.frames;
  }
  return frame;
}

// Carries the history out, each call once; every run is waited for by a step that follows it.
void carry_out(const std::vector<Call>& history, const v1::Session& session, const auto& stub,
               std::atomic<int>& answered) {
  std::int64_t frame = 0;
  for (std::size_t i = 0; i < history.size(); ++i) {
    const std::string id = "call-" + std::to_string(i);
    if (history[i].kind == Call::Kind::kTextile) {
      v1::UpdateTextileRequest request;
      request.set_name(session.name());
      request.mutable_textile()->mutable_raw()->set_bend_n_m2(history[i].bend);
      request.mutable_update_mask()->add_paths("raw.bend_n_m2");
      request.set_request_id(id);
      EXPECT_EQ(insist(stub, &Sessions::UpdateTextile, request).applied_frame(), frame + 1);
    } else if (history[i].kind == Call::Kind::kGrab || history[i].kind == Call::Kind::kDrag) {
      v1::ApplyActionsRequest request;
      request.set_name(session.name());
      request.set_request_id(id);
      if (history[i].kind == Call::Kind::kGrab) {
        request.add_actions()->mutable_grab()->set_particle(7);
      } else {
        v1::Drag* drag = request.add_actions()->mutable_drag();
        drag->set_particle(7);
        drag->mutable_target_m()->set_y(-1e4 * history[i].bend);
      }
      EXPECT_EQ(insist(stub, &Sessions::ApplyActions, request).applied_frame(), frame + 1);
    } else if (history[i].kind == Call::Kind::kRun && history[i].frames > 1) {
      v1::RunSessionRequest run;
      run.set_name(session.name());
      run.set_until_frame(frame + history[i].frames - 1);
      run.set_request_id(id);
      EXPECT_EQ(insist(stub, &Sessions::RunSession, run).applied_frame(), frame + 1);
      v1::StepSessionRequest step;
      step.set_name(session.name());
      step.set_request_id(id + "-end");
      EXPECT_EQ(insist(stub, &Sessions::StepSession, step).frame(), frame + history[i].frames);
      frame += history[i].frames;
    } else {
      v1::StepSessionRequest step;
      step.set_name(session.name());
      step.set_frames(history[i].frames);
      step.set_request_id(id);
      EXPECT_EQ(insist(stub, &Sessions::StepSession, step).frame(), frame + history[i].frames);
      frame += history[i].frames;
    }
    ++answered;
  }
}

TEST_F(RestartedWeftd, KilledAtRandomMomentsLosesNoCallAndNoFrame) {
  constexpr int kKills = 8, kCalls = 160;
  std::mt19937 random(20261121);
  const auto history = make_history(kCalls, random);
  const std::int64_t last = last_frame(history);
  start();
  const auto current = [this] { return stub(); };
  v1::CreateSessionRequest create;
  *create.mutable_session()->mutable_scene() = small_scene();
  create.set_session_id("cloth");
  create.set_request_id("create");
  const v1::Session session = insist(current, &Sessions::CreateSession, create);
  kill_and_start();
  EXPECT_EQ(insist(current, &Sessions::CreateSession, create).uid(), session.uid());

  std::future<Outcome> recorder = record_until(last);
  std::atomic<int> answered = 0;
  std::jthread caller([&] { carry_out(history, session, current, answered); });
  for (int i = 1; i <= kKills; ++i) {
    while (answered < i * kCalls / (kKills + 1)) std::this_thread::yield();
    const auto moment =
        std::chrono::steady_clock::now() + std::chrono::microseconds(random() % 5000);
    while (std::chrono::steady_clock::now() < moment) std::this_thread::yield();
    kill_and_start();
  }
  caller.join();
  const Outcome recorded = recorder.get();
  ASSERT_EQ(recorded.exit, 0) << recorded.err;

  // the same history without kills
  const v1::Session undisturbed = service_.create(small_scene(), "undisturbed");
  carry_out(
      history, undisturbed, [this] { return service_.sessions.get(); }, answered);
  const auto wanted = stream("sessions/undisturbed", 0, last, v1::FRAME_ENCODING_FLOAT64);
  client::RecordingReader reader(path("cloth.weft"));
  ASSERT_EQ(wanted.size(), static_cast<std::size_t>(last) + 1);
  for (const auto& frame : wanted) {
    ASSERT_EQ(reader.read(frame.number()).SerializeAsString(), frame.SerializeAsString())
        << "frame " << frame.number();
  }
}

// Frames that were seen stay as they were, and so does where each call took effect.
TEST_F(RestartedWeftd, KilledInARunChangesNoFrameThatWasSeen) {
  constexpr int kKills = 5, kCalls = 60;
  constexpr std::int64_t kFrames = 2400;
  std::mt19937 random(5);
  start();
  const auto current = [this] { return stub(); };
  v1::CreateSessionRequest create;
  *create.mutable_session()->mutable_scene() = small_scene();
  create.set_session_id("cloth");
  create.set_request_id("create");
  const v1::Session session = insist(current, &Sessions::CreateSession, create);
  const auto set_bend = [](const v1::Session& of, int i) {
    v1::UpdateTextileRequest request;
    request.set_name(of.name());
    request.mutable_textile()->mutable_raw()->set_bend_n_m2(1e-6 * (1 + i % 20));
    request.mutable_update_mask()->add_paths("raw.bend_n_m2");
    request.set_request_id("call-" + std::to_string(i));
    return request;
  };

  std::future<Outcome> recorder = record_until(kFrames);
  v1::RunSessionRequest run;
  run.set_name(session.name());
  run.set_until_frame(kFrames);
  run.set_time_scale(20);
  run.set_request_id("run");
  insist(current, &Sessions::RunSession, run);
  std::atomic<int> answered = 0;
  std::vector<std::int64_t> applied_frames;
  std::jthread caller([&] {
    for (int i = 0; i < kCalls; ++i) {
      const auto answer = insist(current, &Sessions::UpdateTextile, set_bend(session, i));
      applied_frames.push_back(answer.applied_frame());
      ++answered;
    }
  });
  for (int i = 1; i <= kKills; ++i) {
    while (answered < i * kCalls / (kKills + 1)) std::this_thread::yield();
    const auto moment =
        std::chrono::steady_clock::now() + std::chrono::microseconds(random() % 5000);
    while (std::chrono::steady_clock::now() < moment) std::this_thread::yield();
    kill_and_start();
  }
  caller.join();
  const Outcome recorded = recorder.get();
  ASSERT_EQ(recorded.exit, 0) << recorded.err;

  const v1::Session undisturbed = service_.create(small_scene(), "undisturbed");
  const auto calm = [this] { return service_.sessions.get(); };
  std::int64_t frame = 0;
  for (int i = 0; i < kCalls; ++i) {
    const std::int64_t before = applied_frames[static_cast<std::size_t>(i)] - 1;
    if (before >= kFrames) break;
    if (before > frame) service_.step(undisturbed, before - frame);
    frame = before;
    EXPECT_EQ(insist(calm, &Sessions::UpdateTextile, set_bend(undisturbed, i)).applied_frame(),
              before + 1);
  }
  service_.step(undisturbed, kFrames - frame);
  client::RecordingReader reader(path("cloth.weft"));
  for (const auto& wanted :
       stream("sessions/undisturbed", 0, kFrames, v1::FRAME_ENCODING_FLOAT64)) {
    ASSERT_EQ(reader.read(wanted.number()).SerializeAsString(), wanted.SerializeAsString())
        << "frame " << wanted.number();
  }
}

TEST_F(RestartedWeftd, OnAFullDiskRefusesCallsGoesOnAndLosesNoAnswer) {
  start(400'000);  // bytes that a file may have
  const auto current = [this] { return stub(); };
  v1::CreateSessionRequest create;
  *create.mutable_session()->mutable_scene() = small_scene();
  const v1::Session session = insist(current, &Sessions::CreateSession, create);
  v1::RunSessionRequest run;
  run.set_name(session.name());
  insist(current, &Sessions::RunSession, run);

  v1::UpdateTextileRequest update;
  update.set_name(session.name());
  update.mutable_update_mask()->add_paths("raw.bend_n_m2");
  double answered = 0;
  grpc::Status status;
  for (int i = 1; status.ok(); ++i) {
    update.mutable_textile()->mutable_raw()->set_bend_n_m2(1e-8 * i);
    grpc::ClientContext context;
    v1::UpdateTextileResponse response;
    status = stub()->UpdateTextile(&context, update, &response);
    if (status.ok()) answered = response.textile().raw().bend_n_m2();
  }
  const Error error(status);
  EXPECT_EQ(error.code, grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(error.reason(), "STORE_UNWRITABLE");
  EXPECT_THAT(error.message, HasSubstr("sessions.db"));
  EXPECT_TRUE(error.retry);
  EXPECT_GT(answered, 0);

  v1::GetSessionRequest get;
  get.set_name(session.name());
  const std::int64_t frame = insist(current, &Sessions::GetSession, get).frame();
  while (insist(current, &Sessions::GetSession, get).frame() < frame + 500) {
  }
  kill_and_start();
  v1::PauseSessionRequest pause;
  pause.set_name(session.name());
  insist(current, &Sessions::PauseSession, pause);
  const v1::Session after = insist(current, &Sessions::GetSession, get);
  EXPECT_EQ(after.scene().sheets(0).textile().raw().bend_n_m2(), answered);
}

}  // namespace
}  // namespace weft::testing

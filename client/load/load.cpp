#include "client/load/load.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <queue>
#include <random>
#include <tuple>
#include <vector>

#include "client/frame_parts.h"
#include "client/problem.h"

namespace weft::client {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr std::chrono::milliseconds kReportInterval{500};
// What proxies take over one connection, and less than the 1024 that a server does.
constexpr int kStreamsOfAConnection = 100;

Clock::duration ticks(Seconds seconds) {
  return std::chrono::duration_cast<Clock::duration>(seconds);
}

Seconds processor_time() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return Seconds(static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec));
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// One load from its first call to its last. Calls go out from apply(), answers and frames come in
// on gRPC's threads; no lock is held while gRPC is called, which may answer at once.
class Load {
 public:
  Load(Connection& connection, const LoadOrder& order,
       const std::function<void(const LoadResult&)>& progress)
      : connection_(connection), order_(order), progress_(progress) {
    for (const int sessions : order.sessions_of_stages()) {
      result_.stages.emplace_back();
      result_.stages.back().sessions = sessions;
    }
    const std::int64_t streams = std::int64_t{session_count()} * order.subscribers;
    for (std::int64_t i = 0; i < streams; i += kStreamsOfAConnection)
      stream_connections_.push_back(connection.another());
  }

  LoadResult apply() {
    const Seconds cpu = processor_time();
    start_ = Clock::now();
    end_ = stage_start(result_.stages.size());
    sessions_ = std::vector<LoadedSession>(static_cast<std::size_t>(session_count()));
    int before = 0;
    for (std::size_t stage = 0; stage < result_.stages.size(); ++stage) {
      const int sessions = result_.stages[stage].sessions;
      for (int i = before; i < sessions; ++i) {
        LoadedSession& session = sessions_[static_cast<std::size_t>(i)];
        session.index = i;
        const double share = static_cast<double>(i - before) / (sessions - before);
        agenda_.push({stage_start(stage) + ticks(order_.ramp * share), &session, 0});
      }
      before = sessions;
    }
    const std::stop_callback wake(connection_.stop(), [this] {
      const std::lock_guard lock(mutex_);
      changed_.notify_all();
    });
    send_what_is_due();
    const Seconds end_cpu = processor_time();
    stop_sessions();
    const auto last = Clock::now() + ticks(order_.grace);
    wait_until(last, [&] { return calls_ == 0 && all_received(); });
    {
      const std::lock_guard lock(mutex_);
      count_missing();
      result_.wall = end_ - start_;
      result_.cpu = end_cpu - cpu;
    }
    remove_all();
    return std::move(result_);
  }

 private:
  using Sessions = v1::SessionService::Stub;
  class Subscriber;

  struct LoadedSession {
    int index = 0;
    v1::Session session;  // name and uid; no name: not created
    std::vector<std::unique_ptr<Subscriber>> subscribers;
    int openings = 0;  // subscribers whose stream is to open yet
    double frame_step_s = 0;
    std::int64_t substeps_per_frame = 0;                  // as planned
    Clock::time_point origin = Clock::time_point::max();  // when its frame 0 would have been due
    std::int64_t steps = 0;                               // answered
    std::optional<std::int64_t> last_frame;               // that it computed, once that is known
  };

  // A stream of one session's frames.
  class Subscriber : public grpc::ClientReadReactor<v1::StreamFramesResponse> {
   public:
    Subscriber(Load& load, LoadedSession& session, int index)
        : load_(load), session_(session), index_(index) {
      request_.set_session(session.session.name());
      request_.set_uid(session.session.uid());
      request_.set_start_frame(1);
      if (load.order_.drive == Drive::kFree) request_.set_slow_reader(v1::SLOW_READER_HOLD_SESSION);
    }

    void start(v1::FrameService::Stub& stub) {
      Attempts(load_.connection_, request_).address(context_);
      stub.async()->StreamFrames(&context_, &request_, this);
      StartRead(&message_);
      StartCall();
    }
    void cancel() { context_.TryCancel(); }

    void OnReadDone(bool ok) override try {
      if (!ok) return;
      if (message_.has_frame()) {
        if (parts_.join(*message_.mutable_frame()))
          load_.receive(session_, *this, message_.frame(), Clock::now());
      } else if (message_.has_header()) {
        parts_.begin(message_.header());
        note_opening();
      }
      StartRead(&message_);
    } catch (const Problem&) {  // no frame of this stream
      cancel();
    }

    void OnDone(const grpc::Status& status) override {
      note_opening();  // where it did not open it is not waited for
      load_.end_stream(*this, status);
    }

    int index() const { return index_; }

    std::int64_t next_frame = 1;  // guarded by the load, as is `ended`
    bool ended = false;

   private:
    void note_opening() {
      if (!std::exchange(opening_noted_, true)) load_.note_opening(session_);
    }

    Load& load_;
    LoadedSession& session_;
    int index_;
    bool opening_noted_ = false;
    grpc::ClientContext context_;
    v1::StreamFramesRequest request_;
    v1::StreamFramesResponse message_;
    FrameParts parts_;
  };

  // A call to be sent: the creation of a session, or a step of it.
  struct Due {
    Clock::time_point time;
    LoadedSession* session;
    std::int64_t step;  // the frame that it makes; 0: the creation

    bool operator<(const Due& other) const {  // the first one due on top
      return std::tie(other.time, other.session->index) < std::tie(time, session->index);
    }
  };

  template <class Request, class Response>
  struct Call {
    grpc::ClientContext context;
    Request request;
    Response response;
  };

  bool stopped() const { return connection_.stop().stop_requested(); }
  int session_count() const { return result_.stages.back().sessions; }
  Seconds stage_length() const { return order_.ramp + order_.duration; }
  Clock::time_point stage_start(std::size_t stage) const {
    return start_ + ticks(stage_length() * static_cast<double>(stage));
  }
  // Precondition: the time is not before the start.
  StageResult& stage_at(Clock::time_point time) {
    const auto stage = static_cast<std::size_t>(Seconds(time - start_) / stage_length());
    return result_.stages[std::min(stage, result_.stages.size() - 1)];
  }
  // Whether it lies after the ramp of its stage.
  bool is_timed(Clock::time_point time) const {
    for (std::size_t stage = 0; stage < result_.stages.size(); ++stage) {
      const auto start = stage_start(stage);
      if (time >= start && time < start + ticks(order_.ramp)) return false;
    }
    return time >= start_;
  }
  Seconds interval() const { return Seconds(1 / order_.rate_per_s); }

  void send_what_is_due() {
    auto next_report = start_;
    std::unique_lock lock(mutex_);
    while (!stopped() && Clock::now() < end_ && !(order_.frames && all_received())) {
      const auto now = Clock::now();
      if (now >= next_report) {
        next_report = now + kReportInterval;
        report(lock);
      } else if (!agenda_.empty() && agenda_.top().time <= now) {
        const Due due = agenda_.top();
        agenda_.pop();
        lock.unlock();
        if (due.step == 0) {
          create(*due.session, due.time);
        } else {
          step(*due.session, due.step);
        }
        lock.lock();
      } else {
        auto until = std::min(end_, next_report);
        if (!agenda_.empty()) until = std::min(until, agenda_.top().time);
        changed_.wait_until(lock, until);
      }
    }
    closing_ = true;
    end_ = std::min(end_, Clock::now());
  }

  void report(std::unique_lock<std::mutex>& lock) {
    if (!progress_) return;
    result_.frames_due = 0;
    for (const LoadedSession& session : sessions_)
      result_.frames_due += frames_due(session, Clock::now()) * order_.subscribers;
    const LoadResult so_far = result_;
    lock.unlock();
    progress_(so_far);
    lock.lock();
  }

  template <class Done>
  void wait_until(Clock::time_point end, Done done) {
    std::unique_lock lock(mutex_);
    changed_.wait_until(lock, end, done);
  }

  // Sends a call; `then` hears when it was answered and how.
  template <class Request, class Response, class Then>
  void send(void (Sessions::async_interface::*method)(grpc::ClientContext*, const Request*,
                                                      Response*, std::function<void(grpc::Status)>),
            const char* name, const Request& request, Then then) {
    auto call = std::make_shared<Call<Request, Response>>();
    call->request = request;
    Attempts(connection_, request).address(call->context);
    {
      const std::lock_guard lock(mutex_);
      ++calls_;
      // so that every call is answered some time after the end
      const auto patience = std::max(Seconds(end_ - Clock::now()), Seconds(0)) + order_.grace;
      call->context.set_deadline(
          std::chrono::system_clock::now() +
          std::chrono::duration_cast<std::chrono::system_clock::duration>(patience));
    }
    auto answered = [this, call, name, then](const grpc::Status& status) mutable {
      const auto time = Clock::now();
      {
        const std::lock_guard lock(mutex_);
        count_error(name, status);
      }
      then(status.ok() ? &call->response : nullptr, time);
      call.reset();  // which holds the channel, and the last to do so must not be gRPC's own thread
      const std::lock_guard lock(mutex_);
      --calls_;
      changed_.notify_all();
    };
    Call<Request, Response>& sent = *call;
    call.reset();
    (connection_.sessions().async()->*method)(&sent.context, &sent.request, &sent.response,
                                              std::move(answered));
  }

  void count_error(const std::string& call, const grpc::Status& status) {
    if (status.ok()) return;
    const Problem problem = server_problem(status);
    ++stage_at(Clock::now()).errors;
    ++result_.errors[call + ": " + (problem.reason.empty() ? problem.code : problem.reason)];
  }

  void create(LoadedSession& session, Clock::time_point due) {
    v1::CreateSessionRequest request;
    *request.mutable_session()->mutable_scene() = order_.scene;
    request.set_session_id(fmt::format("load-{:08x}-{}", id_, session.index));
    send<v1::CreateSessionRequest, v1::Session>(
        &Sessions::async_interface::CreateSession, "create", request,
        [this, &session, due](const v1::Session* answer, Clock::time_point time) {
          {
            const std::lock_guard lock(mutex_);
            const double seconds = Seconds(time - due).count();
            result_.create.add(seconds);
            stage_at(due).create.add(seconds);
            if (answer == nullptr) return;
            session.session.set_name(answer->name());
            session.session.set_uid(answer->uid());
            session.frame_step_s = answer->scene().solver().frame_step_s();
            session.substeps_per_frame = answer->plan().substeps_per_frame();
            session.openings = order_.subscribers;
            ++result_.sessions;
            if (closing_) return;
          }
          subscribe(session);
          if (order_.subscribers == 0) begin(session);
        });
  }

  void subscribe(LoadedSession& session) {
    for (int i = 0; i < order_.subscribers; ++i) {
      Subscriber* subscriber = nullptr;
      {
        const std::lock_guard lock(mutex_);
        session.subscribers.push_back(std::make_unique<Subscriber>(*this, session, i));
        subscriber = session.subscribers.back().get();
        ++streams_;
      }
      const int stream = session.index * order_.subscribers + i;
      const auto place = static_cast<std::size_t>(stream / kStreamsOfAConnection);
      subscriber->start(stream_connections_[place]->frames());
    }
  }

  // The session begins when all its subscribers are there.
  void note_opening(LoadedSession& session) {
    {
      const std::lock_guard lock(mutex_);
      if (--session.openings > 0 || closing_) return;
    }
    begin(session);
  }

  void begin(LoadedSession& session) {
    if (order_.drive == Drive::kStepped) {
      const std::lock_guard lock(mutex_);
      session.origin = Clock::now();
      await_step(session, 1);
      return;
    }
    v1::RunSessionRequest request;
    request.set_name(session.session.name());
    if (order_.drive == Drive::kPaced)
      request.set_time_scale(order_.rate_per_s * session.frame_step_s);
    if (order_.frames) request.set_until_frame(*order_.frames);
    send<v1::RunSessionRequest, v1::RunSessionResponse>(
        &Sessions::async_interface::RunSession, "run", request,
        [this, &session](const v1::RunSessionResponse* answer, Clock::time_point time) {
          const std::lock_guard lock(mutex_);
          if (answer != nullptr) session.origin = std::min(session.origin, time);
        });
  }

  // The step goes out when it is due, or at once where the one before was answered late.
  void await_step(LoadedSession& session, std::int64_t step) {
    if (order_.frames && step > *order_.frames) return;
    agenda_.push({due_time(session, step), &session, step});
    changed_.notify_all();
  }

  void step(LoadedSession& session, std::int64_t step) {
    v1::StepSessionRequest request;
    request.set_name(session.session.name());
    send<v1::StepSessionRequest, v1::StepSessionResponse>(
        &Sessions::async_interface::StepSession, "step", request,
        [this, &session, step](const v1::StepSessionResponse* answer, Clock::time_point time) {
          const std::lock_guard lock(mutex_);
          add_step(session, step, time);
          session.steps = step;
          if (answer != nullptr) session.last_frame = answer->frame();
          if (!closing_) await_step(session, step + 1);
        });
  }

  Clock::time_point due_time(const LoadedSession& session, std::int64_t frame) const {
    return session.origin + ticks(interval() * static_cast<double>(frame));
  }

  // Frames due by that time.
  std::int64_t frames_due(const LoadedSession& session, Clock::time_point time) const {
    if (order_.drive == Drive::kFree || session.origin >= time) return 0;
    const auto due = static_cast<std::int64_t>(Seconds(time - session.origin) / interval());
    return order_.frames ? std::min(due, *order_.frames) : due;
  }

  void add_latency(Latencies LoadResult::*all, Latencies StageResult::*of_stage,
                   const LoadedSession& session, std::int64_t frame, Clock::time_point time,
                   std::int64_t count = 1) {
    const auto due = due_time(session, frame);
    if (!is_timed(due)) return;
    const double seconds = Seconds(time - due).count();
    (result_.*all).add(seconds, count);
    (stage_at(due).*of_stage).add(seconds, count);
  }
  void add_step(const LoadedSession& session, std::int64_t frame, Clock::time_point time) {
    add_latency(&LoadResult::step, &StageResult::step, session, frame, time);
  }
  void add_frame(const LoadedSession& session, std::int64_t frame, Clock::time_point time,
                 std::int64_t count = 1) {
    add_latency(&LoadResult::frame, &StageResult::frame, session, frame, time, count);
  }

  void receive(LoadedSession& session, Subscriber& subscriber, const v1::Frame& frame,
               Clock::time_point time) {
    const std::int64_t number = frame.number();
    if (order_.on_frame) order_.on_frame(session.index, subscriber.index(), frame);

    const std::lock_guard lock(mutex_);
    ++result_.frames_received;
    if (!closing_ && is_timed(time)) ++stage_at(time).frames_received;
    if (number < subscriber.next_frame) {
      ++result_.frames_doubled;
      return;
    }
    result_.frames_lost += number - subscriber.next_frame;
    subscriber.next_frame = number + 1;
    if (order_.drive != Drive::kFree) {
      session.origin =
          std::min(session.origin, time - ticks(interval() * static_cast<double>(number)));
      add_frame(session, number, time);
    }
    if (closing_ || number == order_.frames) changed_.notify_all();
  }

  void end_stream(Subscriber& subscriber, const grpc::Status& status) {
    const std::lock_guard lock(mutex_);
    if (!cancelled_) count_error("stream", status);
    subscriber.ended = true;
    --streams_;
    changed_.notify_all();
  }

  // Learns how far each session came, so that what is missing can be told.
  void stop_sessions() {
    if (order_.drive == Drive::kStepped) return;  // the steps' answers say it
    for (LoadedSession* session : created()) {
      v1::PauseSessionRequest request;
      request.set_name(session->session.name());
      send<v1::PauseSessionRequest, v1::PauseSessionResponse>(
          &Sessions::async_interface::PauseSession, "pause", request,
          [this, session](const v1::PauseSessionResponse* answer, Clock::time_point) {
            const std::lock_guard lock(mutex_);
            if (answer != nullptr) session->last_frame = answer->applied_frame() - 1;
          });
    }
  }

  std::vector<LoadedSession*> created() {
    const std::lock_guard lock(mutex_);
    std::vector<LoadedSession*> created;
    for (LoadedSession& session : sessions_) {
      if (!session.session.name().empty()) created.push_back(&session);
    }
    return created;
  }

  // With the mutex held; before the sessions are stopped: all that they shall ever have.
  bool all_received() const {
    for (const LoadedSession& session : sessions_) {
      if (!closing_ && session.subscribers.empty()) return false;
      const auto last = closing_ ? session.last_frame : order_.frames;
      for (const auto& subscriber : session.subscribers) {
        if (!subscriber->ended && last && subscriber->next_frame <= *last) return false;
      }
    }
    return true;
  }

  void count_missing() {
    result_.frames_due = 0;
    for (const LoadedSession& session : sessions_) {
      const std::int64_t due = frames_due(session, end_);
      result_.frames_due += due * order_.subscribers;
      std::int64_t computed = session.last_frame.value_or(0);
      for (const auto& subscriber : session.subscribers)
        computed = std::max(computed, subscriber->next_frame - 1);
      result_.planned_substeps += computed * session.substeps_per_frame;
      for (const auto& subscriber : session.subscribers)
        result_.frames_lost += computed + 1 - subscriber->next_frame;
      for (std::int64_t frame = computed + 1; frame <= due; ++frame) {
        add_frame(session, frame, end_, order_.subscribers);
        if (order_.drive == Drive::kStepped && frame > session.steps)
          add_step(session, frame, end_);
      }
    }
  }

  void remove_all() {
    std::vector<Subscriber*> subscribers;
    {
      const std::lock_guard lock(mutex_);
      cancelled_ = true;
      for (const LoadedSession& session : sessions_) {
        for (const auto& subscriber : session.subscribers) subscribers.push_back(subscriber.get());
      }
    }
    for (Subscriber* subscriber : subscribers) subscriber->cancel();
    wait_until(Clock::time_point::max(), [&] { return calls_ == 0 && streams_ == 0; });

    for (const LoadedSession* session : created()) {
      v1::DeleteSessionRequest request;
      request.set_name(session->session.name());
      request.set_allow_missing(true);
      send<v1::DeleteSessionRequest, v1::DeleteSessionResponse>(
          &Sessions::async_interface::DeleteSession, "delete", request,
          [](const v1::DeleteSessionResponse*, Clock::time_point) {});
    }
    wait_until(Clock::time_point::max(), [&] { return calls_ == 0; });
  }

  Connection& connection_;
  const unsigned id_ = std::random_device()();  // of the load, in names of its sessions
  const LoadOrder& order_;
  const std::function<void(const LoadResult&)>& progress_;
  std::vector<std::unique_ptr<Connection>> stream_connections_;
  Clock::time_point start_;

  std::mutex mutex_;  // guards all below
  std::condition_variable changed_;
  std::priority_queue<Due> agenda_;
  std::vector<LoadedSession> sessions_;
  Clock::time_point end_;
  LoadResult result_;
  std::int64_t calls_ = 0;    // under way
  std::int64_t streams_ = 0;  // open
  bool closing_ = false;      // nothing more is begun
  bool cancelled_ = false;    // the streams, by ourselves
};

}  // namespace

std::int64_t LoadResult::error_count() const {
  std::int64_t count = 0;
  for (const auto& [reason, number] : errors) count += number;
  return count;
}

LoadResult apply_load(Connection& connection, const LoadOrder& order,
                      const std::function<void(const LoadResult&)>& progress) {
  return Load(connection, order, progress).apply();
}

}  // namespace weft::client

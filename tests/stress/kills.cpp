#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <future>
#include <mutex>
#include <random>
#include <stop_token>
#include <thread>
#include <variant>
#include <vector>

#include "client/load/latencies.h"
#include "client/output/text.h"
#include "client/recording/reader.h"
#include "client/recording/recorder.h"
#include "client/templates/templates.h"
#include "server/rpc/convert.h"
#include "tests/stress/offline.h"
#include "tests/stress/stress.h"
#include "tests/stress/weftd.h"

namespace weft::stress {
namespace {

using Clock = std::chrono::steady_clock;
using Sessions = v1::SessionService::Stub;

// Sends the call until it is answered, through kills.
template <class Request, class Response>
Response insist(client::Connection& connection,
                grpc::Status (Sessions::*method)(grpc::ClientContext*, const Request&, Response*),
                const Request& request) {
  for (;;) try {
      return connection.call(method, request);
    } catch (const client::Problem& problem) {
      if (problem.exit != client::Exit::kNoConnection && problem.code != "UNKNOWN") throw;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
}

// When each recorder heard its newest frame.
class Hearing {
 public:
  explicit Hearing(std::size_t recorders) : heard_(recorders) {}

  void note(std::size_t recorder, std::int64_t frame) {
    const std::lock_guard lock(mutex_);
    if (heard_[recorder].frame == frame) return;
    heard_[recorder] = {frame, Clock::now()};
    changed_.notify_all();
  }

  // The times at which all of them had heard something after `moment`.
  std::vector<Clock::time_point> wait_for_all_after(Clock::time_point moment) {
    std::unique_lock lock(mutex_);
    std::vector<Clock::time_point> times;
    for (const Heard& heard : heard_) {
      if (!changed_.wait_for(lock, std::chrono::minutes(2), [&] { return heard.time > moment; }))
        throw std::runtime_error("a recorder does not go on within two minutes");
      times.push_back(heard.time);
    }
    return times;
  }

 private:
  struct Heard {
    std::int64_t frame = -1;
    Clock::time_point time;
  };

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Heard> heard_;
};

// A change that the server acknowledged.
struct Change {
  v1::UpdateTextileRequest request;
  std::int64_t applied_frame = 0;
};

struct Recorded {
  v1::Session session;
  std::string path;
  std::vector<Change> changes;
  std::future<client::RecordingResult> recorder;
};

v1::UpdateTextileRequest change_of(const v1::Session& session, int number) {
  v1::UpdateTextileRequest request;
  request.set_name(session.name());
  request.mutable_textile()->mutable_raw()->set_bend_n_m2(1e-6 * (1 + number % 20));
  request.mutable_update_mask()->add_paths("raw.bend_n_m2");
  request.set_request_id(fmt::format("change-{}", number));
  return request;
}

// Changes textiles, each call until it is acknowledged.
void change_textiles(client::Connection& connection, std::vector<Recorded>& all,
                     const std::stop_token& stop) {
  for (int number = 0; !stop.stop_requested(); ++number) {
    Recorded& one = all[static_cast<std::size_t>(number) % all.size()];
    Change change{change_of(one.session, number)};
    change.applied_frame =
        insist(connection, &Sessions::UpdateTextile, change.request).applied_frame();
    one.changes.push_back(std::move(change));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

struct Faults {
  std::int64_t frames = 0;
  std::int64_t lost = 0;
  std::int64_t differing = 0;
};

// Holds a recording to what the core computes with the acknowledged changes.
void compare(const v1::Scene& scene, const Recorded& one, std::int64_t last, Faults& faults) {
  client::RecordingReader reader(one.path);
  faults.lost += last - reader.last_frame() + reader.first_frame();
  Simulation simulation = simulation_of(scene);
  std::size_t done = 0;
  for (std::int64_t number = 0; number <= reader.last_frame(); ++number) {
    for (; done < one.changes.size() && one.changes[done].applied_frame <= number; ++done) {
      const v1::UpdateTextileRequest& request = one.changes[done].request;
      const Textile& current = simulation.scene().sheets[0].textile;
      const auto textile = merge_textile(current, request.textile(), request.update_mask());
      simulation.set_textile(0, std::get<Textile>(textile));
    }
    if (number > 0 && !simulation.advance_frame()) throw std::runtime_error(simulation.failure());
    ++faults.frames;
    if (reader.read(number).positions_m() != double_planes(simulation)) ++faults.differing;
  }
}

}  // namespace

// weftd is killed at random moments while sessions run, are changed and are recorded.
Outcome kills(Form form) {
  constexpr double kLongestResume = 2;  // s, 95 of 100
  const int kills = form == Form::kShort ? 5 : 200;
  const v1::Scene scene = client::make_template("load", {.rows = 8, .columns = 8});
  Weftd weftd;
  const auto connection = weftd.connect();
  std::vector<Recorded> all(4);
  Hearing hearing(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    v1::CreateSessionRequest create;
    *create.mutable_session()->mutable_scene() = scene;
    all[i].session = connection->call(&Sessions::CreateSession, create);
    all[i].path = weftd.path(fmt::format("{}.weft", i));
    client::RecordingOrder order;
    order.session = all[i].session.name();
    order.path = all[i].path;
    order.encoding = v1::FRAME_ENCODING_FLOAT64;
    order.run = false;
    all[i].recorder = std::async(std::launch::async, [&, i, order] {
      return client::record(*connection, order, [&, i](const client::Tally& tally) {
        if (tally.frames > 0) hearing.note(i, tally.last_frame);
      });
    });
  }
  hearing.wait_for_all_after(Clock::time_point());  // frame 0
  for (const Recorded& one : all) {
    v1::RunSessionRequest run;
    run.set_name(one.session.name());
    run.set_time_scale(1);
    insist(*connection, &Sessions::RunSession, run);
  }

  std::mt19937 random(20261121);
  client::Latencies resumes;
  const auto caller_connection = weftd.connect();
  auto caller = std::make_unique<std::jthread>(
      [&](const std::stop_token& stop) { change_textiles(*caller_connection, all, stop); });
  for (int i = 0; i < kills; ++i) {
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 400'000));
    const auto killed = Clock::now();
    weftd.kill_and_start();
    for (const auto& heard : hearing.wait_for_all_after(Clock::now()))
      resumes.add(std::chrono::duration<double>(heard - killed).count());
  }
  caller.reset();

  Faults faults;
  std::size_t changes = 0;
  for (Recorded& one : all) {
    v1::PauseSessionRequest pause;
    pause.set_name(one.session.name());
    insist(*connection, &Sessions::PauseSession, pause);
    one.recorder.get();
    compare(scene, one, connection->get_session(one.session.name()).frame(), faults);
    changes += one.changes.size();
  }
  const double resume = resumes.quantile(0.95);
  return {.figure = fmt::format("{} kills, {} frames in {} recordings, {} lost, {} differing from "
                                "the core with the {} changes acknowledged; resumed within {} p95",
                                kills, faults.frames, all.size(), faults.lost, faults.differing,
                                changes, client::seconds_text(resume)),
          .hold = "0, 0; 2 s",
          .counts = faults.frames > 0 && faults.lost == 0 && faults.differing == 0,
          .bounds = resume <= kLongestResume};
}

}  // namespace weft::stress

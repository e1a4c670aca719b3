#include <fmt/format.h>

#include <chrono>
#include <random>
#include <stop_token>
#include <thread>
#include <vector>

#include "client/load/latencies.h"
#include "client/output/text.h"
#include "client/templates/templates.h"
#include "tests/stress/recorded.h"
#include "tests/stress/stress.h"
#include "tests/stress/weftd.h"

namespace weft::stress {
namespace {

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

}  // namespace

// weftd is killed at random moments while sessions run, are changed and are recorded.
Outcome kills(Form form) {
  constexpr double kLongestResume = 2;  // s, 95 of 100
  const int kills = form == Form::kShort ? 5 : 200;
  const v1::Scene scene = client::make_template("load", {.rows = 8, .columns = 8});
  Weftd weftd;
  const auto connection = weftd.connect();
  Hearing hearing(4);
  std::vector<Recorded> all = record_sessions(weftd, *connection, scene, hearing);

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

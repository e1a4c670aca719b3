#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <random>
#include <stop_token>
#include <thread>
#include <vector>

#include "client/load/latencies.h"
#include "client/output/text.h"
#include "client/templates/templates.h"
#include "tests/stress/at_end.h"
#include "tests/stress/caller.h"
#include "tests/stress/recorded.h"
#include "tests/stress/stress.h"
#include "tests/stress/weftd.h"

namespace weft::stress {
// weftd is killed at random moments while sessions run, are changed and are recorded.
Outcome kills(Form form) {
  constexpr double kLongestResume = 2;  // s, 95 of 100
  const int kills = form == Form::kShort ? 5 : 200;
  const v1::Scene scene = client::make_template("load", {.rows = 8, .columns = 8});
  Weftd weftd({"--snapshot-ms", "20"});  // each restart begins at the last one
  const auto connection = weftd.connect();
  Hearing hearing(4);
  std::stop_source stop;
  const auto recorders = weftd.connect(stop.get_token());
  std::vector<Recorded> all = record_sessions(weftd.path(""), *recorders, scene, hearing);
  const AtEnd give_up([&] { stop.request_stop(); });

  std::mt19937 random(20261121);
  client::Latencies resumes;
  auto caller = std::make_unique<Caller>(weftd.connect(), all);
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
    finish(*connection, scene, one, faults);
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

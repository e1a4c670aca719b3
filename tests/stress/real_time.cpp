#include <fmt/format.h>

#include <chrono>
#include <thread>

#include "client/load/load.h"
#include "client/output/text.h"
#include "client/templates/templates.h"
#include "tests/stress/stress.h"
#include "tests/stress/weftd.h"

namespace weft::stress {

// How many sessions of the scene `load` this machine holds at 60 frames a second, the client on it
// included. A session that is late is not wrong, so counts are those of the load that held.
Outcome real_time(Form form) {
  constexpr int kHold = 150;  // on two cores
  const bool is_short = form == Form::kShort;
  const Weftd weftd({"--max-sessions", "10000", "--max-streams", "10000"});
  const auto connection = weftd.connect();
  client::LoadOrder order{.scene = client::make_template("load")};
  order.ramp = std::chrono::milliseconds(is_short ? 500 : 5000);
  order.duration = std::chrono::milliseconds(is_short ? 1500 : 30'000);
  client::LimitSearch search{.first = 8};
  search.target_s = 1 / order.rate_per_s;
  client::Probe held;
  std::int64_t wrong = 0;
  const int limit = client::find_limit(*connection, order, search, [&](const client::Probe& probe) {
    if (probe.holds) held = probe;
    wrong += probe.result.frames_lost + probe.result.frames_doubled;
  });
  return {.figure = fmt::format("{} sessions at 60 frames/s, p99 lateness {}, client {:.2f} of a "
                                "core, {} threads; {} lost or doubled",
                                limit, client::seconds_text(held.result.frame.quantile(0.99)),
                                limit > 0 ? held.result.cpu / held.result.wall : 0.0,
                                std::thread::hardware_concurrency(), wrong),
          .hold = fmt::format("{} on 2 cores, 16.67 ms", kHold),
          .counts = wrong == 0,
          .bounds = limit >= kHold};
}

}  // namespace weft::stress

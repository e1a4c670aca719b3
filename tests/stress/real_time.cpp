#include <fmt/format.h>

#include <chrono>
#include <thread>

#include "client/load/limit.h"
#include "client/load/load.h"
#include "client/output/text.h"
#include "client/templates/templates.h"
#include "client/textile_file.h"
#include "tests/stress/stress.h"
#include "tests/stress/weftd.h"

namespace weft::stress {

namespace {

struct Held {
  int sessions = 0;
  client::Probe probe;     // the largest load that held
  std::int64_t wrong = 0;  // frames lost or doubled in any
};

Held find_held(Form form, const client::TemplateOptions& options) {
  const bool is_short = form == Form::kShort;
  const Weftd weftd({"--max-sessions", "10000", "--max-streams", "10000"});
  const auto connection = weftd.connect();
  client::LoadOrder order{.scene = client::make_template("load", options)};
  order.ramp = std::chrono::milliseconds(is_short ? 500 : 5000);
  order.duration = std::chrono::milliseconds(is_short ? 1500 : 30'000);
  client::LimitSearch search{.first = 8};
  search.target_s = 1 / order.rate_per_s;
  Held held;
  held.sessions = client::find_limit(*connection, order, search, [&](const client::Probe& probe) {
    if (probe.holds) held.probe = probe;
    held.wrong += probe.result.frames_lost + probe.result.frames_doubled;
  });
  return held;
}

}  // namespace

// How many sessions of the scene `load` this machine holds at 60 frames a second, the client on it
// included; in the long form also of textiles as they are sold. A session that is late is not
// wrong, so counts are those of the load that held.
Outcome real_time(Form form) {
  constexpr int kHold = 150;  // on two cores
  const Held held = find_held(form, {});
  const client::LoadResult& load = held.probe.result;
  Outcome outcome{
      .figure = fmt::format("{} sessions at 60 frames/s, p99 lateness {}, client {:.2f} of a core, "
                            "{} threads; {} lost or doubled",
                            held.sessions, client::seconds_text(load.frame.quantile(0.99)),
                            held.sessions > 0 ? load.cpu / load.wall : 0.0,
                            std::thread::hardware_concurrency(), held.wrong),
      .hold = fmt::format("{} on 2 cores, 16.67 ms", kHold),
      .counts = held.wrong == 0,
      .bounds = held.sessions >= kHold};
  if (form == Form::kShort) return outcome;
  for (const char* textile : {"wool_tropical", "cotton_poplin"})
    outcome.figure += fmt::format(
        "; {}: {}", textile, find_held(form, {.textile = client::textile_named(textile)}).sessions);
  return outcome;
}

}  // namespace weft::stress

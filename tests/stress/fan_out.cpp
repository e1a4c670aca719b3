#include <fmt/format.h>

#include <chrono>

#include "client/load/load.h"
#include "client/output/text.h"
#include "client/templates/templates.h"
#include "tests/stress/stress.h"
#include "tests/stress/weftd.h"

namespace weft::stress {
namespace {

// Of a core, that weftd takes under that load.
double server_share(const Weftd& weftd, client::Connection& connection,
                    const client::LoadOrder& order, client::LoadResult& result) {
  const double before = weftd.usage().cpu_s;
  result = client::apply_load(connection, order);
  return (weftd.usage().cpu_s - before) / result.wall.count();
}

}  // namespace

// One session that many watch. What the solver takes is measured without anyone and taken off.
Outcome fan_out(Form form) {
  constexpr double kMostCores = 1;
  constexpr std::int64_t kMostMemory = 150'000'000;
  const bool is_short = form == Form::kShort;
  const Weftd weftd({"--max-streams", "2000"});
  const auto connection = weftd.connect();
  client::LoadOrder order{.scene = client::make_template("load"), .sessions = 1};
  order.rate_per_s = 30;
  order.duration = std::chrono::seconds(is_short ? 3 : 60);
  client::LoadResult result;
  order.subscribers = 0;
  const double alone = server_share(weftd, *connection, order, result);
  order.subscribers = is_short ? 300 : 1000;
  const double transport = server_share(weftd, *connection, order, result) - alone;
  const std::int64_t memory = weftd.usage().most_memory;
  return {
      .figure = fmt::format("{} subscribers, {} of {} frames, {} lost, {} doubled, {} errors; p99 "
                            "lateness {}, transport {:.2f} of a core, weftd {}, client {:.2f}",
                            order.subscribers, result.frames_received, result.frames_due,
                            result.frames_lost, result.frames_doubled, result.error_count(),
                            client::seconds_text(result.frame.quantile(0.99)), transport,
                            client::bytes_text(memory), result.cpu / result.wall),
      .hold = "0, 0, 0; 1 core, 150 MB",
      .counts = result.clean() && result.frames_received > 0,
      .bounds = transport <= kMostCores && memory <= kMostMemory};
}

}  // namespace weft::stress

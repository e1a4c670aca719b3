#include "client/load/limit.h"

#include <algorithm>

namespace weft::client {

int find_limit(Connection& connection, LoadOrder order, const LimitSearch& search,
               const std::function<void(const Probe&)>& tried,
               const std::function<void(int, const LoadResult&)>& progress) {
  const auto holds = [&](int sessions) {
    order.sessions = sessions;
    Probe probe{.sessions = sessions, .result = {}};
    probe.result = apply_load(connection, order, [&](const LoadResult& so_far) {
      if (progress) progress(sessions, so_far);
    });
    probe.holds = probe.result.clean() && probe.result.frame.quantile(0.99) <= search.target_s;
    tried(probe);
    return probe.holds;
  };
  const auto stopped = [&] { return connection.stop().stop_requested(); };

  int held = 0;
  int broken = search.most + 1;
  for (int next = search.first; next > held && next < broken && !stopped();) {
    (holds(next) ? held : broken) = next;
    next = broken > search.most ? std::min(2 * held, search.most) : held + (broken - held) / 2;
    if (broken <= search.most && broken - held <= held / 20) break;
  }
  return held;
}

}  // namespace weft::client

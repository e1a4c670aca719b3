#pragma once

#include <functional>

#include "client/load/load.h"

namespace weft::client {

// Loads of different numbers of sessions, to find the largest that a server holds.
struct LimitSearch {
  int first = 10;  // to be tried
  int most = 10'000;
  double target_s = 0;  // that 99 of 100 frames do not exceed
};

struct Probe {
  int sessions = 0;
  LoadResult result;
  bool holds = false;  // clean, and within the target
};

// The largest number of sessions that held, within 5 %; 0: not even one. Doubles the number until
// one does not hold, then halves the interval. `order` says all but the number; `tried` is
// called after every load.
int find_limit(Connection& connection, LoadOrder order, const LimitSearch& search,
               const std::function<void(const Probe&)>& tried,
               const std::function<void(int sessions, const LoadResult&)>& progress = {});

}  // namespace weft::client

#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "client/connection.h"

namespace weft::client {

// Garments that a server is to put on, each in a session of its own.
struct GarmentsOrder {
  v1::Scene scene;  // of each
  int garments = 20;
  int at_once = 1;
  double seconds = 20;  // most simulated time until one is at rest
};

struct GarmentsResult {
  int done = 0;
  int good = 0;
  std::map<std::string, int> faults;  // garments with each, "CLOTH_CUTS"
  std::map<std::string, int> errors;  // garments that came to no verdict, by reason
  std::int64_t substeps = 0;
  double computing_s = 0;  // as the server says
  std::chrono::duration<double> wall{};

  double per_hour() const { return wall.count() > 0 ? 3600 * done / wall.count() : 0; }
};

// Calls `progress` after each garment, one at a time. A stop of the connection ends it early; the
// sessions are deleted in any case.
GarmentsResult put_on(Connection& connection, const GarmentsOrder& order,
                      const std::function<void(const GarmentsResult&)>& progress);

}  // namespace weft::client

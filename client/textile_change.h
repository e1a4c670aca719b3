#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "weft/v1/session.pb.h"

namespace weft::client {

// New values for the textile of a sheet: a preset's, or some by name.
struct TextileChange {
  std::string sheet{};   // empty: the only one
  std::string preset{};  // damping and friction are not the preset's
  std::vector<std::pair<std::string, double>> values{};  // "bend_n_m2" or "raw.bend_n_m2"
  std::optional<double> duration_s{};                    // simulated; absent: at once
};

// Throws where a textile has no such number.
v1::UpdateTextileRequest textile_request(const v1::Session& session, const TextileChange& change);

}  // namespace weft::client

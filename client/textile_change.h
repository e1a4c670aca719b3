#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "weft/v1/session.pb.h"

namespace weft::client {

// New values for the textile of a sheet: another textile, or some values by name.
struct TextileChange {
  std::string sheet{};                   // empty: the only one
  std::optional<v1::Textile> textile{};  // damping and friction stay where it gives none
  std::vector<std::pair<std::string, double>> values{};  // "bend_n_m2" or "raw.bend_n_m2"
  std::optional<double> duration_s{};                    // simulated; absent: at once
};

// Throws where a textile has no such number.
v1::UpdateTextileRequest textile_request(const v1::Session& session, const TextileChange& change);

}  // namespace weft::client

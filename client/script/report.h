#pragma once

#include <string>
#include <vector>

#include "client/output/json.h"
#include "client/script/performance.h"

namespace weft::client {

// The results of a script's cases, in their order.
std::string report_text(const Script& script, const std::vector<CaseResult>& results,
                        std::size_t columns);
Json report_json(const Script& script, const std::vector<CaseResult>& results);
// A test suite of JUnit's schema, each case a test of it.
std::string report_junit(const Script& script, const std::vector<CaseResult>& results);

}  // namespace weft::client

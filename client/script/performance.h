#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "client/connection.h"
#include "client/script/script.h"

namespace weft::client {

// A verdict's faults, by their codes.
struct VerdictFinding {
  std::set<std::string> faults, wanted;
  std::string text;  // their sentences
};

// What an expectation found.
struct Finding {
  int line = 0;
  std::string name;
  double value = 0;
  double low = 0;
  double high = 0;
  bool passed = false;
  std::optional<VerdictFinding> verdict{};  // instead of values
};

struct Failure {
  int line = 0;
  std::string step;
  std::string message;
};

// What became of a case.
struct CaseResult {
  std::size_t steps_done = 0;
  std::vector<Finding> findings;
  std::vector<Failure> failures;
  std::vector<std::string> recordings;
  std::chrono::duration<double> wall{};
  bool ended = false;  // by itself; otherwise it was interrupted, or never begun

  bool passed() const { return failures.empty() && ended; }
};

// Performs the steps of a case on sessions of its own, which it deletes in the end. A step that
// fails ends it; an expectation that is not met does not.
CaseResult perform(Connection& connection, const Case& performed, bool replace,
                   const std::function<void(const std::string& status)>& progress);

// "largest_strain is 0.0652, above 0.05"
std::string finding_text(const Finding& finding);

}  // namespace weft::client

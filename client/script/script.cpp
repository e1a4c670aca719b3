#include "client/script/script.h"

#include <fmt/format.h>

#include <algorithm>

#include "client/output/text.h"

namespace weft::client {

std::string place_in_script(const std::string& path, int line, const std::string& field) {
  return fmt::format("{}, line {}{}{}", path, line, field.empty() ? "" : ": ", field);
}

void Faults::add(const std::string& place, const std::string& description) {
  const bool known =
      std::any_of(violations_.begin(), violations_.end(), [&](const Violation& violation) {
        return violation.field == place && violation.description == description;
      });
  if (!known) violations_.push_back({place, description});
}

void Faults::check(const std::string& path) const {
  if (violations_.empty()) return;
  const auto count = static_cast<std::int64_t>(violations_.size());
  Problem problem(Exit::kFile, "INVALID_ARGUMENT", "SCRIPT_INVALID",
                  violations_.size() == 1 ? violations_[0].field + ": " + violations_[0].description
                                          : fmt::format("{}: {}", path, count_of(count, "fault")));
  problem.violations = violations_;
  throw problem;
}

}  // namespace weft::client

#include "client/script/report.h"

#include <fmt/format.h>

#include <cmath>
#include <pugixml.hpp>
#include <sstream>

#include "client/output/text.h"

namespace weft::client {
namespace {

std::string failure_text(const Script& script, const Failure& failure) {
  return fmt::format("{}: {}", place_in_script(script.path, failure.line, failure.step),
                     failure.message);
}

// JSON has no infinity; there is none where nothing bounds.
Json bound(double value) { return std::isfinite(value) ? Json(value) : Json(); }

std::int64_t failed(const std::vector<CaseResult>& results) {
  std::int64_t count = 0;
  for (const CaseResult& result : results) count += result.failures.empty() ? 0 : 1;
  return count;
}

}  // namespace

std::string report_text(const Script& script, const std::vector<CaseResult>& results,
                        std::size_t columns) {
  Table table({"CASE", "RESULT", "STEPS", "WALL"});
  std::string failures;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const CaseResult& result = results[i];
    const bool failed = !result.failures.empty();
    table.add({script.cases[i].name,
               failed         ? "FAILED"
               : result.ended ? "passed"
                              : "interrupted",
               fmt::format("{} of {}", result.steps_done, script.cases[i].steps.size()),
               fmt::format("{:.1f} s", result.wall.count())});
    for (const Failure& failure : result.failures)
      failures += fmt::format("{}: {}\n", script.cases[i].name, failure_text(script, failure));
  }
  return table.text(columns) + (failures.empty() ? "" : '\n' + failures);
}

Json report_json(const Script& script, const std::vector<CaseResult>& results) {
  Json cases = Json::array();
  for (std::size_t i = 0; i < results.size(); ++i) {
    const CaseResult& result = results[i];
    Json values = Json::object();
    for (const auto& [name, value] : script.cases[i].values) values[name] = value;
    Json findings = Json::array();
    for (const Finding& finding : result.findings) {
      if (finding.verdict) {
        findings.push_back({{"line", finding.line},
                            {"quantity", finding.name},
                            {"faults", finding.verdict->faults},
                            {"wanted", finding.verdict->wanted},
                            {"passed", finding.passed}});
        continue;
      }
      findings.push_back({{"line", finding.line},
                          {"quantity", finding.name},
                          {"value", bound(finding.value)},
                          {"min", bound(finding.low)},
                          {"max", bound(finding.high)},
                          {"passed", finding.passed}});
    }
    Json failures = Json::array();
    for (const Failure& failure : result.failures) {
      failures.push_back(
          {{"line", failure.line}, {"step", failure.step}, {"message", failure.message}});
    }
    cases.push_back({{"name", script.cases[i].name},
                     {"values", std::move(values)},
                     {"passed", result.passed()},
                     {"interrupted", !result.ended},
                     {"steps_done", result.steps_done},
                     {"steps", script.cases[i].steps.size()},
                     {"wall_s", result.wall.count()},
                     {"recordings", result.recordings},
                     {"expectations", std::move(findings)},
                     {"failures", std::move(failures)}});
  }
  return {{"script", script.path},
          {"name", script.name},
          {"failed", failed(results)},
          {"cases", std::move(cases)}};
}

std::string report_junit(const Script& script, const std::vector<CaseResult>& results) {
  pugi::xml_document document;
  pugi::xml_node suite = document.append_child("testsuite");
  double wall = 0;
  for (const CaseResult& result : results) wall += result.wall.count();
  suite.append_attribute("name").set_value(script.name.c_str());
  suite.append_attribute("tests").set_value(static_cast<unsigned>(results.size()));
  suite.append_attribute("failures").set_value(static_cast<unsigned>(failed(results)));
  suite.append_attribute("time").set_value(fmt::format("{:.3f}", wall).c_str());
  for (std::size_t i = 0; i < results.size(); ++i) {
    pugi::xml_node test = suite.append_child("testcase");
    test.append_attribute("classname").set_value(script.name.c_str());
    test.append_attribute("name").set_value(script.cases[i].name.c_str());
    test.append_attribute("time").set_value(fmt::format("{:.3f}", results[i].wall.count()).c_str());
    for (const Failure& failure : results[i].failures) {
      pugi::xml_node child = test.append_child("failure");
      child.append_attribute("message").set_value(failure.message.c_str());
      child.text().set(failure_text(script, failure).c_str());
    }
    if (!results[i].ended)
      test.append_child("skipped").append_attribute("message").set_value("interrupted");
  }
  std::ostringstream text;
  document.save(text, "  ");
  return text.str();
}

}  // namespace weft::client

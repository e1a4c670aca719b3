#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/script/script.h"

namespace weft::client {

// Where the reading of a script stands.
struct Scope {
  const std::string& path;
  std::map<std::string, std::string> variables;
  Faults& faults;
};

// "0.1" of "$k_b": the variables put in; $$ stands for $.
std::string put_in_variables(const std::string& text,
                             const std::map<std::string, std::string>& variables);

// The fields of a mapping, each asked for by name. What is not as asked is noted as a fault and
// taken for absent, so that reading goes on.
class Fields {
 public:
  // `place` is its path in the script, "create".
  Fields(const YAML::Node& node, std::string place, Scope& scope);

  bool has(const std::string& key) const;
  std::optional<std::string> text(const std::string& key);
  std::optional<double> number(const std::string& key,
                               double low = std::numeric_limits<double>::lowest(),
                               double high = std::numeric_limits<double>::max());
  std::optional<std::int64_t> whole_number(const std::string& key, std::int64_t low,
                                           std::int64_t high);
  std::optional<bool> flag(const std::string& key);
  // One text or a list of them.
  std::vector<std::string> texts(const std::string& key);
  // For a field that is no scalar; undefined where absent.
  YAML::Node node(const std::string& key);
  // Every key, in order; all count as known.
  std::vector<std::string> keys();

  void fault(const std::string& key, const std::string& description);
  // Notes every field that was not asked for.
  void end();

  int line() const { return line_; }
  std::string place(const std::string& key) const;

 private:
  std::optional<std::string> scalar(const YAML::Node& node, const std::string& key);

  std::map<std::string, YAML::Node> nodes_;
  std::vector<std::string> keys_;
  std::vector<std::string> known_;
  std::string place_;
  Scope& scope_;
  int line_;
};

std::optional<double> read_number(const std::string& text);

}  // namespace weft::client

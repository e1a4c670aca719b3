#include "client/script/fields.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace weft::client {
namespace {

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

// Throws Violation: a variable that there is not.
const std::string& value_of(const std::string& name,
                            const std::map<std::string, std::string>& variables) {
  const auto found = variables.find(name);
  if (found == variables.end()) throw Violation{"", "there is no variable $" + name};
  return found->second;
}

}  // namespace

std::optional<double> read_number(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

std::string put_in_variables(const std::string& text,
                             const std::map<std::string, std::string>& variables) {
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    if (text[i] != '$') {
      result += text[i++];
      continue;
    }
    std::size_t begin = ++i;
    if (i < text.size() && text[i] == '$') {
      result += text[i++];
      continue;
    }
    const bool in_parentheses = i < text.size() && text[i] == '(';
    if (in_parentheses) begin = ++i;
    while (i < text.size() && is_word(text[i])) ++i;
    result += value_of(text.substr(begin, i - begin), variables);
    if (in_parentheses && (i == text.size() || text[i++] != ')'))
      throw Violation{"", "a variable lacks its closing parenthesis in " + text};
  }
  return result;
}

Fields::Fields(const YAML::Node& node, std::string place, Scope& scope)
    : place_(std::move(place)), scope_(scope), line_(std::max(node.Mark().line, 0) + 1) {
  if (!node.IsMap()) {
    if (!node.IsNull())
      scope.faults.add(place_in_script(scope.path, line_, place_), "fields are wanted here");
    return;
  }
  for (const auto& entry : node) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
    if (!nodes_.emplace(key, entry.second).second)
      scope.faults.add(place_in_script(scope.path, entry.first.Mark().line + 1, this->place(key)),
                       "is given twice");
    keys_.push_back(key);
  }
}

std::string Fields::place(const std::string& key) const {
  return place_.empty() || key.empty() ? place_ + key : place_ + "." + key;
}

void Fields::fault(const std::string& key, const std::string& description) {
  const auto found = nodes_.find(key);
  const int line = found == nodes_.end() ? line_ : found->second.Mark().line + 1;
  scope_.faults.add(place_in_script(scope_.path, line > 0 ? line : line_, place(key)), description);
}

YAML::Node Fields::node(const std::string& key) {
  known_.push_back(key);
  const auto found = nodes_.find(key);
  return found == nodes_.end() ? YAML::Node(YAML::NodeType::Undefined) : found->second;
}

bool Fields::has(const std::string& key) const { return nodes_.contains(key); }

std::vector<std::string> Fields::keys() {
  known_ = keys_;
  return keys_;
}

std::optional<std::string> Fields::scalar(const YAML::Node& node, const std::string& key) {
  if (!node.IsScalar()) {
    fault(key, "one value is wanted here");
    return std::nullopt;
  }
  try {
    return put_in_variables(node.Scalar(), scope_.variables);
  } catch (const Violation& violation) {
    fault(key, violation.description);
    return std::nullopt;
  }
}

std::optional<std::string> Fields::text(const std::string& key) {
  const YAML::Node value = node(key);
  return has(key) ? scalar(value, key) : std::nullopt;
}

std::vector<std::string> Fields::texts(const std::string& key) {
  std::vector<std::string> result;
  const YAML::Node value = node(key);
  if (!has(key)) return result;
  if (!value.IsSequence()) {
    if (auto one = scalar(value, key)) result.push_back(*one);
    return result;
  }
  for (const auto& each : value) {
    if (auto one = scalar(each, key)) result.push_back(*one);
  }
  return result;
}

std::optional<double> Fields::number(const std::string& key, double low, double high) {
  const auto given = text(key);
  if (!given) return std::nullopt;
  const auto value = read_number(*given);
  if (!value) {
    fault(key, fmt::format("\"{}\" is not a number", *given));
  } else if (*value < low || *value > high) {
    fault(key, fmt::format("{} is not within {:g} to {:g}", *given, low, high));
  } else {
    return value;
  }
  return std::nullopt;
}

std::optional<std::int64_t> Fields::whole_number(const std::string& key, std::int64_t low,
                                                 std::int64_t high) {
  const auto given = text(key);
  if (!given) return std::nullopt;
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(given->data(), given->data() + given->size(), value);
  if (error != std::errc() || end != given->data() + given->size()) {
    fault(key, fmt::format("\"{}\" is not a whole number", *given));
  } else if (value < low || value > high) {
    fault(key, fmt::format("{} is not within {} to {}", value, low, high));
  } else {
    return value;
  }
  return std::nullopt;
}

std::optional<bool> Fields::flag(const std::string& key) {
  const auto given = text(key);
  if (!given) return std::nullopt;
  if (*given == "true" || *given == "false") return *given == "true";
  fault(key, fmt::format("\"{}\" is not true or false", *given));
  return std::nullopt;
}

void Fields::end() {
  for (const std::string& key : keys_) {
    if (std::find(known_.begin(), known_.end(), key) == known_.end())
      fault(key, fmt::format("no such field; there are {}", fmt::join(known_, ", ")));
  }
}

}  // namespace weft::client

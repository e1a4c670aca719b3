#include "client/garments/pattern_file.h"

#include <fmt/format.h>

#include "client/input_file.h"
#include "client/json_file.h"

namespace weft::client {
namespace {

// Within 100 columns on one line, else a member a line.
std::string laid_out(const Json& json, std::size_t indent) {
  constexpr std::size_t kMost = 100;
  std::string flat = json.dump();
  if (indent + flat.size() <= kMost || !json.is_structured() || json.empty()) return flat;
  const bool list = json.is_array();
  const std::string space(indent + 2, ' ');
  std::string text = list ? "[" : "{";
  bool first = true;
  for (const auto& [name, value] : json.items()) {
    text += fmt::format("{}\n{}", first ? "" : ",", space);
    first = false;
    const std::string label = list ? "" : Json(name).dump() + ": ";
    text += label + laid_out(value, indent + 2);
  }
  return text + '\n' + std::string(indent, ' ') + (list ? "]" : "}");
}

}  // namespace

ImportedPattern read_pattern(const std::string& path) {
  const std::string text = read_text(path);
  const Json json = parse_json(path, text);
  if (is_garment_code(json)) return read_garment_code(path, json);
  if (json.is_object() && json.contains("sheets"))
    throw malformed(path, "is a scene, not a pattern");
  ImportedPattern read;
  read_message(path, text, read.pattern);
  return read;
}

std::string pattern_text(const v1::Pattern& pattern) {
  return laid_out(to_json(pattern, Defaults::kLeftOut), 0) + '\n';
}

}  // namespace weft::client

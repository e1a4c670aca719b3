#include "client/textile_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "client/input_file.h"
#include "client/json_file.h"
#include "client/output/json.h"
#include "client/problem.h"

namespace weft::client {

bool is_textile_file(const std::string& name) { return name.ends_with(".json"); }

v1::TextilePreset read_textile_file(const std::string& path) {
  v1::TextilePreset textile;
  read_json(path, textile);
  return textile;
}

std::string textile_file_text(const v1::TextilePreset& textile) {
  return to_json(textile, Defaults::kLeftOut).dump(2) + '\n';
}

v1::Textile textile_named(const std::string& preset_or_file) {
  v1::Textile textile;
  if (!is_textile_file(preset_or_file)) {
    textile.set_preset(preset_or_file);
    return textile;
  }
  const std::string text = read_text(preset_or_file);
  const Json json = parse_json(preset_or_file, text);
  if (!json.is_object() || !json.contains("values")) {
    read_message(preset_or_file, text, textile);
    return textile;
  }
  v1::TextilePreset own;
  read_message(preset_or_file, text, own);
  if (!own.missing().empty())
    throw malformed(preset_or_file,
                    fmt::format("values are missing: {}", fmt::join(own.missing(), ", ")));
  *textile.mutable_measured() = own.values();
  return textile;
}

}  // namespace weft::client

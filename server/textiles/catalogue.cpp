#include "server/textiles/catalogue.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <stdexcept>
#include <string>

namespace weft {

std::string_view presets_json();  // made of presets.json by CMake

namespace {

constexpr std::string_view kCollection = "textiles/";

std::vector<v1::TextilePreset> parse_presets() {
  v1::ListTextilesResponse list;
  const auto status =
      google::protobuf::util::JsonStringToMessage(std::string(presets_json()), &list);
  if (!status.ok()) {
    throw std::logic_error("presets.json: " + status.ToString());
  }
  std::vector<v1::TextilePreset> result(list.textiles().begin(), list.textiles().end());
  std::ranges::sort(result, {}, &v1::TextilePreset::name);
  return result;
}

}  // namespace

const std::vector<v1::TextilePreset>& presets() {
  static const std::vector<v1::TextilePreset> result = parse_presets();
  return result;
}

const v1::TextilePreset* find_preset(std::string_view name) {
  if (name.starts_with(kCollection)) {
    name.remove_prefix(kCollection.size());
  }
  const auto found = std::ranges::find_if(presets(), [&](const v1::TextilePreset& preset) {
    return std::string_view(preset.name()).substr(kCollection.size()) == name;
  });
  return found == presets().end() ? nullptr : &*found;
}

}  // namespace weft

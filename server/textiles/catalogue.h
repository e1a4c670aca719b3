#pragma once

#include <string_view>
#include <vector>

#include "weft/v1/textile.pb.h"

namespace weft {

// The textiles of presets.json, which is part of the binary, in order of name.
const std::vector<v1::TextilePreset>& presets();

// The preset called "textiles/x" or "x"; null when there is none.
const v1::TextilePreset* find_preset(std::string_view name);

}  // namespace weft

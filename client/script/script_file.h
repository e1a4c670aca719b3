#pragma once

#include <map>
#include <string>

#include "client/script/script.h"

namespace weft::client {

// Reads a YAML script, its loops unrolled and its variables put in; some of them may be given other
// values. All that is wrong with it is thrown at once.
Script read_script(const std::string& path, const std::map<std::string, std::string>& values = {});

}  // namespace weft::client

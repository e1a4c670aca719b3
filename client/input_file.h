#pragma once

#include <string>

namespace weft::client {

// All of a file; one that cannot be read is a Problem.
std::string read_text(const std::string& path);

}  // namespace weft::client

#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace weft::testing {

std::string from_base64(const std::string& text);

// What a script element of a page of weft view holds as one zlib stream, in base64.
std::string inflated(const std::string& page, const std::string& id);

// What the page says of itself and its recordings.
nlohmann::json description(const std::string& page);

}  // namespace weft::testing

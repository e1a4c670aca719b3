#pragma once

#include <string>

#include "client/imports/garment_code.h"

namespace weft::client {

// A pattern from a file: JSON of weft.v1.Pattern, or GarmentCode's. What cannot be understood is a
// Problem with file and line, or panel and edge.
ImportedPattern read_pattern(const std::string& path);

// The text of a pattern file: an edge a line, so that people can read and change it.
std::string pattern_text(const v1::Pattern& pattern);

}  // namespace weft::client

#pragma once

#include <string>

#include "weft/v1/textile.pb.h"

namespace weft::client {

// Whether a textile's name is that of a file.
bool is_textile_file(const std::string& name);

// A file of `weft textile new`: JSON of weft.v1.TextilePreset, values with their sources. What
// cannot be understood is a Problem with file and line, here and below.
v1::TextilePreset read_textile_file(const std::string& path);
std::string textile_file_text(const v1::TextilePreset& textile);

// By the name of a preset, or from a file: one of `weft textile new`, or JSON of weft.v1.Textile.
v1::Textile textile_named(const std::string& preset_or_file);

}  // namespace weft::client

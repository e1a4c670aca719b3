#pragma once

#include <google/protobuf/message.h>

#include <string>

#include "client/output/json.h"

namespace weft::client {

// Reads the protobuf JSON of a message. What cannot be understood is a Problem with file and line.
void read_json(const std::string& path, google::protobuf::Message& into);

// The same in two steps, for those who look at the JSON first; `text` is the file's.
Json parse_json(const std::string& path, const std::string& text);
void read_message(const std::string& path, const std::string& text,
                  google::protobuf::Message& into);

}  // namespace weft::client

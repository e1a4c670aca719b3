#pragma once

#include <google/protobuf/message.h>

#include <string>

namespace weft::client {

// Sets a value by its place, "sheets[0].grid.rows", from its text. An element one past the last of
// a list is added to it; of a oneof, what was there before is gone. Throws Problem where there is
// no such place, or the text is no value for it.
void set_field(google::protobuf::Message& message, const std::string& place,
               const std::string& value);

}  // namespace weft::client

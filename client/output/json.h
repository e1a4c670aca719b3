#pragma once

#include <google/protobuf/message.h>

#include <nlohmann/json.hpp>

#include "client/problem.h"

namespace weft::client {

using Json = nlohmann::ordered_json;

enum class Defaults { kShown, kLeftOut };

// Protobuf JSON with the names of the .proto files, and 64-bit integers as numbers.
Json to_json(const google::protobuf::Message& message, Defaults defaults = Defaults::kShown);

// {"error": {"code", "reason", "message", "violations"}}
Json to_json(const Problem& problem);

}  // namespace weft::client

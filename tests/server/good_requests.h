#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <memory>
#include <string>
#include <vector>

#include "weft/v1/scene.pb.h"

namespace weft::testing {

// A scene with every field of the interface in it.
v1::Scene full_scene();

// Bytes of the asset that requests speak of.
std::string known_asset();
// Of its body.
std::string known_body();

// Good requests of a type, as text; of a type that has none here they are made up from its fields.
std::vector<std::string> known_requests(const std::string& type);

// The same as messages.
std::vector<std::unique_ptr<google::protobuf::Message>> good_requests(
    const google::protobuf::Descriptor& type);

}  // namespace weft::testing

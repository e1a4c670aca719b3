#pragma once

#include <string>

#include "client/connection.h"

namespace weft::client {

// Reads the protobuf JSON of a scene. What cannot be understood is a Problem with file and line.
v1::Scene read_scene(const std::string& path);

// A session made from the scene, or with validate_only what it would be. What the server finds
// wrong is named by its place in the scene file.
v1::Session create_session(Connection& connection, const v1::Scene& scene,
                           v1::CreateSessionRequest request = {});

// The text of a scene file.
std::string scene_text(const v1::Scene& scene);

}  // namespace weft::client

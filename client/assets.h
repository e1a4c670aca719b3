#pragma once

#include <cstddef>
#include <string>

#include "client/connection.h"
#include "weft/v1/asset.pb.h"
#include "weft/v1/mesh.pb.h"
#include "weft/v1/scene.pb.h"

namespace weft::client {

// Larger meshes do not travel within a scene.
inline constexpr std::size_t kMostInline = 1 << 20;  // bytes

// Sends a mesh, or as much of it as the server has not got. A stream that breaks goes on where it
// broke, see Attempts.
v1::Asset upload_mesh(Connection& connection, const v1::MeshData& mesh);

// The scene with assets in the place of its larger meshes.
v1::Scene upload_meshes(Connection& connection, v1::Scene scene);

}  // namespace weft::client

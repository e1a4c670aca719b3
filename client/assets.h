#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "client/connection.h"
#include "weft/v1/asset.pb.h"
#include "weft/v1/mesh.pb.h"
#include "weft/v1/scene.pb.h"

namespace weft::client {

// Larger meshes do not travel within a scene.
inline constexpr std::size_t kMostInline = 1 << 20;  // bytes

// "assets/{hash}" of its bytes.
std::string asset_name(const std::string& bytes);

// Sends a mesh, or as much of it as the server has not got. A stream that breaks goes on where it
// broke, see Attempts.
v1::Asset upload_mesh(Connection& connection, const v1::MeshData& mesh);

// The scene with assets in the place of its larger meshes.
v1::Scene upload_meshes(Connection& connection, v1::Scene scene);

// Bytes by name.
using Assets = std::map<std::string, std::string>;

// What the scene names, as far as the server has it for us.
Assets assets_of(Connection& connection, const v1::Scene& scene);

// The scene with meshes in the place of the assets that are there.
v1::Scene with_meshes(v1::Scene scene, const Assets& assets);
// The same of colliders alone.
v1::Scene with_bodies(v1::Scene scene, const Assets& assets);

}  // namespace weft::client

#pragma once

#include "client/imports/imported_mesh.h"

namespace weft::client {

// Reads the bytes of a glTF file, text or binary: every triangle of the meshes in its scene, where
// their nodes put them; flat shapes are TEXCOORD_0, v upwards as in OBJ; a panel is a primitive,
// named by its mesh or material. Buffers in files lie beside it. Points that it has twice, for
// their normals or UV differ, are one. What cannot be used is a Problem.
ImportedMesh read_gltf(const std::string& path, const std::string& bytes);

}  // namespace weft::client

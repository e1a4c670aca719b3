#pragma once

#include "client/imports/imported_mesh.h"
#include "weft/v1/mesh.pb.h"

namespace weft::client {

// The mesh as scenes have it; the grain is that of all panels. Particles keep their order.
v1::MeshData mesh_data(const ImportedMesh& mesh, double grain_rad);

// Positions and triangles alone.
v1::MeshData body_data(const ImportedMesh& mesh);

}  // namespace weft::client

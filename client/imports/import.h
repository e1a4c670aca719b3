#pragma once

#include <optional>

#include "client/imports/flat_shape.h"
#include "client/imports/imported_mesh.h"

namespace weft::client {

struct ImportOptions {
  std::optional<double> flat_scale{};  // m for a unit of UV
  double unit_m = 1;                   // of positions in the file
  bool z_up = false;                   // in the file; y is up in scenes
  double grain_rad = 0;                // from the v axis to the warp, anticlockwise
  bool mend = false;
};

// A mesh that can be simulated, its notes telling what was done to it.
struct Import {
  ImportedMesh mesh;      // in m, y up, triangles ordered by panel, flat shape anticlockwise
  double flat_scale = 1;  // m for a unit of UV
  bool has_uv = true;     // else the flat shape is the mesh's own plane
  std::optional<ScaleFound> found{};  // of UV
};

// Reads an .obj, .gltf or .glb file. All that is wrong is one Problem, with the places in the file.
Import import_mesh(const std::string& path, const ImportOptions& options);
// The same from its bytes.
Import import_mesh(const std::string& path, const std::string& bytes, const ImportOptions& options);

// A body from the same files: all of their triangles, in m, y up. Whether it is closed is for the
// server to say.
ImportedMesh import_body(const std::string& path, const ImportOptions& options);

// By its ending: what weft imports.
bool is_mesh_file(const std::string& path);

}  // namespace weft::client

#pragma once

#include <map>
#include <optional>

#include "client/imports/import.h"
#include "weft/v1/scene.pb.h"

namespace weft::client {

struct MeshSceneOptions {
  std::optional<v1::Textile> textile{};  // its model alone where it gives no damping
  std::map<std::string, v1::Textile> panel_textiles{};
  std::vector<std::string> pins{};  // as select_particles reads them
  std::optional<v1::Accuracy> accuracy{};
  double grain_rad = 0;
};

// A scene of the mesh alone, named after its file, where the file has it.
v1::Scene make_mesh_scene(const std::string& path, const ImportedMesh& mesh,
                          const MeshSceneOptions& options);

}  // namespace weft::client

#pragma once

#include <string>

#include "client/imports/mesh_facts.h"
#include "client/imports/mesh_scene.h"

namespace weft {

// All that weft scene new does with a mesh, as it is and mended; a Problem is an answer too.
inline void import_all(const std::string& path, const std::string& bytes) {
  for (const bool mend : {false, true}) {
    try {
      const client::Import import = client::import_mesh(path, bytes, {.mend = mend});
      client::facts_text(import, client::facts_of(import));
      client::make_mesh_scene(path, import.mesh, {.pins = {"0"}});
    } catch (const client::Problem&) {
      continue;
    }
  }
}

}  // namespace weft

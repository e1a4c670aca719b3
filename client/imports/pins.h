#pragma once

#include "client/imports/imported_mesh.h"

namespace weft::client {

// Particles of a mesh by words: "border:top", "border:2", "panel:front", "panel:front:border:left",
// "box:x0,y0,z0:x1,y1,z1" (m), or their numbers, "0,5,7-12". Ascending, one at least; a Problem
// says what there is instead.
std::vector<int> select_particles(const ImportedMesh& mesh, const std::string& words);

}  // namespace weft::client

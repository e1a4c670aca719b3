#pragma once

#include <utility>

#include "client/imports/imported_mesh.h"

namespace weft::client {

// Pairs of triangles that cover each other in the flat shape, both of one piece of it; at most a
// hundred. No triangle is turned over.
std::vector<std::pair<int, int>> find_overlaps(const ImportedMesh& mesh);

}  // namespace weft::client

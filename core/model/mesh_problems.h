#pragma once

#include <string>
#include <vector>

#include "core/model/scene.h"

namespace weft {

// Everything that keeps triangles from being a sheet; `field` is the mesh's path. At most `most`.
std::vector<Problem> find_problems(const TriangleMesh& mesh, const std::string& field,
                                   std::size_t most = 1000);

}  // namespace weft

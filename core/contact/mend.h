#pragma once

#include <string>
#include <vector>

#include "core/model/body.h"
#include "core/model/scene.h"

namespace weft {

// A mesh that encloses its insides, or what keeps it from that; paths begin with `field`. Vertices
// at one place become one, and triangles are turned over where they face inward, which is noted.
struct MendedMesh {
  BodyMesh mesh;
  std::vector<int> source;  // triangle of the given mesh, of each
  std::vector<std::string> notes;
  std::vector<Problem> problems;
};
MendedMesh mend(BodyMesh mesh, const std::string& field);

}  // namespace weft

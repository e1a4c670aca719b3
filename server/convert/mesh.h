#pragma once

#include <string>
#include <vector>

#include "core/model/scene.h"
#include "weft/v1/asset.pb.h"
#include "weft/v1/mesh.pb.h"

namespace weft {

// Everything that keeps a mesh from being used. Paths begin with `field`.
std::vector<Problem> find_problems(const v1::MeshData& mesh, const std::string& field);

// Particles of a mesh, whatever else is wrong with it.
std::int64_t particles_of(const v1::MeshData& mesh);

// Precondition: find_problems has nothing to say of it.
v1::MeshFacts facts_of(const v1::MeshData& mesh);

}  // namespace weft

#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/model/scene.h"
#include "server/convert/convert.h"
#include "weft/v1/asset.pb.h"
#include "weft/v1/mesh.pb.h"

namespace weft {

// A mesh that can be simulated, or everything that is wrong with it. Paths begin with `field`.
Converted<Triangles> to_mesh(const v1::MeshData& from, const std::string& field);

// A body, and the poses that it moves through; nullptr: none.
struct ConvertedBody {
  SharedBody body;
  std::shared_ptr<const Poses> poses;
};
// For sheets with skins up to `reach`, m, with cells of that edge, m, or all that is wrong with its
// mesh. Idle threads of the scheduler, where one is given, help to make it.
Converted<ConvertedBody> to_body(const v1::MeshData& from, std::optional<double> cell, double reach,
                                 const std::string& field, Scheduler* scheduler = nullptr);
// What is wrong with a mesh that is neither a sheet nor a body.
std::vector<Problem> find_problems(const v1::MeshData& mesh, const std::string& field);

// Triangles, flat shape and panels of a sheet, without positions.
v1::MeshData topology_of(const SheetShape& shape);

v1::MeshData to_proto(const Triangles& mesh);

// Particles of a mesh, whatever else is wrong with it.
std::int64_t particles_of(const v1::MeshData& mesh);

// Precondition: to_mesh() takes it.
v1::MeshFacts facts_of(const v1::MeshData& mesh);

}  // namespace weft

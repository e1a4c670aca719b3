#include "client/imports/stitches.h"

#include <fmt/format.h>

#include <algorithm>

#include "client/imports/edges.h"
#include "client/imports/flat_shape.h"

namespace weft::client {

void sew(ImportedMesh& mesh) {
  if (mesh.stitches.empty()) return;
  const bool has_flat = std::ranges::any_of(mesh.corners, [](const auto& corners) {
    return std::ranges::any_of(corners, [](int i) { return i != kNoCorner; });
  });
  if (!has_flat && flatten_pieces(mesh))
    mesh.notes.emplace_back("it has no UV: its flat shape is the planes that its pieces lie in");

  constexpr double kAt = 1e-3, kMiddle = 0.5;
  Unions unions(mesh.positions.size());
  int between = 0;
  for (const ImportedMesh::Stitch& stitch : mesh.stitches) {
    unions.join(stitch.point, stitch.share < kMiddle ? stitch.first : stitch.second);
    between += std::min(stitch.share, 1 - stitch.share) > kAt ? 1 : 0;
  }
  std::vector<int> set;
  const auto count = as_index(unions.number(set));
  std::vector<Vector3d> sum(count, Vector3d::Zero());
  std::vector<int> members(count);
  for (std::size_t i = 0; i < set.size(); ++i) {
    sum[as_index(set[i])] += mesh.positions[i];
    ++members[as_index(set[i])];
  }
  mesh.positions.resize(count);
  for (std::size_t s = 0; s < count; ++s) mesh.positions[s] = sum[s] / members[s];
  for (auto& triangle : mesh.triangles)
    for (int& i : triangle) i = set[as_index(i)];
  mesh.notes.push_back(fmt::format(
      "{} stitch{} sewn{}", mesh.stitches.size(), mesh.stitches.size() == 1 ? "" : "es",
      between == 0 ? "" : fmt::format(", {} of them to the nearer of two points", between)));
  mesh.stitches.clear();
}

}  // namespace weft::client

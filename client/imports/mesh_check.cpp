#include "client/imports/mesh_check.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numeric>

#include "client/imports/edges.h"
#include "client/imports/flat_overlap.h"
#include "client/imports/flat_shape.h"

namespace weft::client {
namespace {

constexpr double kEmpty = 1e-6;  // least height over longest edge

std::array<Vector3d, 3> corners_in_space(const ImportedMesh& mesh, std::size_t t) {
  const auto& [a, b, c] = mesh.triangles[t];
  return {mesh.positions[as_index(a)], mesh.positions[as_index(b)], mesh.positions[as_index(c)]};
}

std::string edge_text(const ImportedMesh& mesh, const Side& side) {
  return fmt::format("from {} to {}", position_text(mesh.positions[as_index(side.low)]),
                     position_text(mesh.positions[as_index(side.high)]));
}

std::vector<std::string> places_of(const ImportedMesh& mesh, std::span<const Side> sides) {
  constexpr std::size_t kMost = 4;
  std::vector<std::string> places;
  for (const Side& side : sides.first(std::min(sides.size(), kMost)))
    places.push_back(place(mesh, side.triangle));
  return places;
}

void add_edge_faults(const ImportedMesh& mesh, std::vector<Fault>& faults) {
  std::vector<Fault> shared, opposite;
  for_each_edge(sides_of(mesh.triangles), [&](std::span<const Side> sides) {
    if (sides[0].low == sides[0].high) return;  // of an empty triangle
    const std::string where = place(mesh, sides[0].triangle);
    if (sides.size() > 2) {
      shared.push_back(
          {where, fmt::format("its edge {} belongs to {} triangles, not to 2 at most: {}; {}",
                              edge_text(mesh, sides[0]), sides.size(),
                              fmt::join(places_of(mesh, sides), ", "),
                              surroundings(mesh, sides[0].triangle))});
    } else if (sides.size() == 2 && sides[0].ascending == sides[1].ascending) {
      opposite.push_back(
          {where, fmt::format("faces the other way than {} beside it, at its edge {}; {} (--mend "
                              "turns it)",
                              place(mesh, sides[1].triangle), edge_text(mesh, sides[0]),
                              surroundings(mesh, sides[0].triangle))});
    }
  });
  add_some(faults, shared);
  add_some(faults, opposite);
}

void add_fault_where(const ImportedMesh& mesh, const std::vector<bool>& found, const char* what,
                     std::vector<Fault>& faults) {
  std::vector<Fault> kind;
  for (std::size_t t = 0; t < found.size(); ++t) {
    const auto triangle = static_cast<int>(t);
    if (found[t])
      kind.push_back(
          {place(mesh, triangle), fmt::format("{}; {}", what, surroundings(mesh, triangle))});
  }
  add_some(faults, kind);
}

}  // namespace

bool is_empty(const std::array<Vector3d, 3>& corners) {
  double longest = 0;
  for (std::size_t k = 0; k < 3; ++k)
    longest = std::max(longest, (corners[(k + 1) % 3] - corners[k]).norm());
  const double twice = (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
  return twice <= kEmpty * longest * longest;
}

std::vector<bool> find_repeated(const ImportedMesh& mesh) {
  std::vector<std::array<int, 3>> sorted = mesh.triangles;
  for (auto& triangle : sorted) std::sort(triangle.begin(), triangle.end());
  std::vector<std::size_t> order(sorted.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return sorted[a] < sorted[b]; });
  std::vector<bool> repeated(sorted.size(), false);
  for (std::size_t i = 1; i < order.size(); ++i)
    repeated[order[i]] = sorted[order[i]] == sorted[order[i - 1]];
  return repeated;
}

int count_pieces(const ImportedMesh& mesh) {
  Unions unions(mesh.triangles.size());
  for_each_edge(sides_of(mesh.triangles), [&](std::span<const Side> sides) {
    for (const Side& side : sides) unions.join(sides[0].triangle, side.triangle);
  });
  std::vector<int> piece;
  return unions.number(piece);
}

std::vector<Fault> find_faults(const ImportedMesh& mesh) {
  std::vector<bool> empty(mesh.triangles.size()), absent(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    empty[t] = is_empty(corners_in_space(mesh, t));
    absent[t] = std::ranges::find(mesh.corners[t], kNoCorner) != mesh.corners[t].end();
  }
  std::vector<Fault> faults;
  add_fault_where(mesh, empty, "is a triangle without area (--mend drops it)", faults);
  add_fault_where(mesh, find_repeated(mesh),
                  "has the same corners as a triangle before it (--mend drops it)", faults);
  add_edge_faults(mesh, faults);
  add_fault_where(mesh, absent, "has no UV, though others do: unfold it, or leave it out", faults);
  return faults;
}

std::vector<Fault> find_flat_faults(const ImportedMesh& mesh) {
  std::vector<bool> empty(mesh.triangles.size()), inverted(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const FlatCorners corners = flat_corners(mesh, t);
    const double height = least_height(corners);
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k)
      longest = std::max(longest, (corners[(k + 1) % 3] - corners[k]).norm());
    empty[t] = height <= kEmpty * longest;
    inverted[t] = !empty[t] && signed_area(corners) < 0;
  }
  std::vector<Fault> faults;
  add_fault_where(mesh, empty, "has no area in its UV (--mend collapses it)", faults);
  add_fault_where(mesh, inverted, "is turned over in its UV, beside neighbours that are not",
                  faults);
  if (!faults.empty()) return faults;

  std::vector<Fault> folds;
  for (const auto& [a, b] : find_overlaps(mesh))
    folds.push_back(
        {place(mesh, a), fmt::format("lies over {} in the UV of one piece, which is folded "
                                     "there: cut it apart; {}",
                                     place(mesh, b), surroundings(mesh, a))});
  add_some(faults, folds);
  return faults;
}

}  // namespace weft::client

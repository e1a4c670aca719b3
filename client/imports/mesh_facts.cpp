#include "client/imports/mesh_facts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>

#include "client/imports/edges.h"
#include "client/imports/mesh_check.h"

namespace weft::client {
namespace {

std::vector<PanelFacts> panels_of(const ImportedMesh& mesh) {
  std::vector<PanelFacts> panels(mesh.panels.size());
  std::vector<Eigen::AlignedBox2d> boxes(panels.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::size_t p = as_index(mesh.panel[t]);
    const FlatCorners corners = flat_corners(mesh, t);
    for (const Vector2d& corner : corners) boxes[p].extend(corner);
    panels[p].area += signed_area(corners);
    ++panels[p].triangles;
  }
  for (std::size_t p = 0; p < panels.size(); ++p) {
    panels[p].name = mesh.panels[p];
    panels[p].size = boxes[p].sizes();
  }
  return panels;
}

// Corners of a triangle at the ends of an edge, the lower particle's first.
std::pair<int, int> ends_of(const ImportedMesh& mesh, const Side& side) {
  const auto& corners = mesh.corners[as_index(side.triangle)];
  const int from = corners[as_index(side.k)], to = corners[as_index((side.k + 1) % 3)];
  return side.ascending ? std::pair(from, to) : std::pair(to, from);
}

double flat_length(const ImportedMesh& mesh, const Side& side) {
  const auto [a, b] = ends_of(mesh, side);
  return (mesh.flat[as_index(b)] - mesh.flat[as_index(a)]).norm();
}

std::vector<SeamFacts> seams_of(const ImportedMesh& mesh) {
  std::map<std::pair<int, int>, SeamFacts> seams;
  for_each_edge(sides_of(mesh.triangles), [&](std::span<const Side> sides) {
    if (sides.size() != 2 || ends_of(mesh, sides[0]) == ends_of(mesh, sides[1])) return;
    Side first = sides[0], second = sides[1];
    const auto panel = [&](const Side& side) { return mesh.panel[as_index(side.triangle)]; };
    if (panel(first) > panel(second)) std::swap(first, second);
    SeamFacts& seam = seams[{panel(first), panel(second)}];
    seam.first = mesh.panels[as_index(panel(first))];
    seam.second = mesh.panels[as_index(panel(second))];
    seam.length +=
        (mesh.positions[as_index(first.high)] - mesh.positions[as_index(first.low)]).norm();
    seam.first_flat += flat_length(mesh, first);
    seam.second_flat += flat_length(mesh, second);
  });
  std::vector<SeamFacts> result;
  for (auto& [panels, seam] : seams) result.push_back(std::move(seam));
  return result;
}

void find_lowest(const ImportedMesh& mesh, MeshFacts& facts) {
  constexpr std::size_t kShown = 3;
  std::vector<std::pair<double, int>> heights;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    heights.emplace_back(least_height(mesh, t), static_cast<int>(t));
  std::sort(heights.begin(), heights.end());
  facts.median_height = heights[heights.size() / 2].first;
  for (std::size_t i = 0; i < std::min(heights.size(), kShown); ++i) {
    const auto [height, triangle] = heights[i];
    facts.lowest.push_back({place(mesh, triangle), surroundings(mesh, triangle), height,
                            facts.median_height / height});
  }
}

void find_border_facts(const ImportedMesh& mesh, MeshFacts& facts) {
  const View view = view_of(mesh.positions);
  facts.borders = find_borders(mesh.positions, mesh.triangles, view);
  for (const char* name : kBorderSides) {
    const auto is_named = [&](const Border& border) { return border.name == name; };
    if (std::ranges::any_of(facts.borders, is_named)) continue;
    const double length = border_called(mesh.positions, mesh.triangles, view, name).length;
    if (length > 0) facts.sides.emplace_back(name, length);
  }
}

}  // namespace

MeshFacts facts_of(const Import& import) {
  const ImportedMesh& mesh = import.mesh;
  MeshFacts facts;
  facts.particles = static_cast<int>(mesh.positions.size());
  facts.triangles = static_cast<int>(mesh.triangles.size());
  facts.pieces = count_pieces(mesh);
  Eigen::AlignedBox3d box;
  for (const Vector3d& each : mesh.positions) box.extend(each);
  facts.size = box.sizes();
  facts.panels = panels_of(mesh);
  facts.seams = seams_of(mesh);
  find_border_facts(mesh, facts);
  find_lowest(mesh, facts);
  return facts;
}

}  // namespace weft::client

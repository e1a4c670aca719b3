#include "core/triangles/triangles.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "core/triangles/connections.h"
#include "core/triangles/folds.h"
#include "core/triangles/rest_shape.h"

namespace weft {
namespace {

const MeasuredTextile& measured(const SheetDefinition& sheet, int panel) {
  return std::get<MeasuredTextile>(textile_of(sheet, panel).model);
}

// Mass and drag go by area, or are one for all.
void set_particles(const SheetDefinition& sheet, const RestShape& shape, Mesh& mesh) {
  mesh.mass = VectorXd::Zero(shape.particles);
  VectorXd drag = mesh.mass;
  if (const auto* raw = std::get_if<RawTextile>(&sheet.textile.model)) {
    mesh.mass.setConstant(raw->particle_mass);
    if (raw->air_drag > 0) mesh.drag = VectorXd::Constant(shape.particles, raw->air_drag);
    return;
  }
  for (std::size_t t = 0; t < shape.triangles.size(); ++t) {
    const MeasuredTextile& textile = measured(sheet, panel_of(shape, t));
    const double third = area(shape.corners[t]) / 3;
    for (const int i : shape.triangles[t]) {
      mesh.mass[i] += textile.areal_density * third;
      drag[i] += textile.air_drag * third;
    }
  }
  if (drag.maxCoeff() > 0) mesh.drag = drag;
}

}  // namespace

const Textile& textile_of(const SheetDefinition& sheet, int panel) {
  for (const PanelTextile& each : sheet.panel_textiles)
    if (each.panel == panel) return each.textile;
  return sheet.textile;
}

std::vector<std::vector<int>> borders_of(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> uses;  // of edges
  for (const auto& triangle : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) ++uses[std::minmax(triangle[k], triangle[(k + 1) % 3])];
  std::map<int, std::vector<int>> ways;  // along borders, from a particle
  for (const auto& [edge, count] : uses) {
    if (count != 1) continue;
    ways[edge.first].push_back(edge.second);
    ways[edge.second].push_back(edge.first);
  }
  std::vector<std::vector<int>> borders;
  for (auto& [start, left] : ways)
    while (!left.empty()) {
      std::vector<int>& border = borders.emplace_back();
      int at = start;
      do {
        border.push_back(at);
        const int to = ways[at].back();
        ways[at].pop_back();
        std::erase(ways[to], at);
        at = to;
      } while (at != start && !ways[at].empty());
    }
  return borders;
}

double least_density(const SheetDefinition& sheet) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t p = 0; p < triangles_in(sheet).panels.size(); ++p)
    least = std::min(least, measured(sheet, static_cast<int>(p)).areal_density);
  return least;
}

Mesh make_triangles(const SheetDefinition& sheet) {
  const RestShape shape = rest_shape(triangles_in(sheet));
  Mesh mesh;
  mesh.damping = sheet.textile.damping.value_or(kDefaultDamping);
  set_particles(sheet, shape, mesh);
  mesh.triangles = shape.triangles;
  if (std::holds_alternative<ChoiKo>(sheet.bending)) {
    add_connections(sheet, shape, mesh);
    return mesh;
  }

  Surface& surface = mesh.surface;
  surface.pushes = resists_compression(sheet.bending);
  bool stretches = false, bends = false;
  for (std::size_t p = 0; p < triangles_in(sheet).panels.size(); ++p) {
    const MeasuredTextile& textile = measured(sheet, static_cast<int>(p));
    surface.stretch.push_back({textile.tensile_warp, textile.tensile_weft, 0, textile.shear});
    surface.bend.push_back({textile.bend_rigidity_warp, textile.bend_rigidity_weft,
                            (textile.bend_rigidity_warp + textile.bend_rigidity_weft) / 2});
    stretches |= textile.tensile_warp + textile.tensile_weft + textile.shear > 0;
    bends |= textile.bend_rigidity_warp + textile.bend_rigidity_weft > 0;
  }
  // what pulls at nothing is not there
  if (stretches) surface.membrane = make_membrane(shape);
  if (bends) {
    const std::vector<Fold>& folds = triangles_in(sheet).folds;
    surface.fits = fit_curvature(shape, folds);
    surface.hinges = make_hinges(shape, folds, surface.bend);
  }
  if (mesh.damping > 0) {
    Family& family = mesh.families.emplace_back(Family{FamilyKind::kDamp, 0, 0, {}, {}});
    for (const auto& [i, j] : edges(shape)) family.connections.add(i, j);
  }
  return mesh;
}

}  // namespace weft

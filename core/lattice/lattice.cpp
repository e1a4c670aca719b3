#include "core/lattice/lattice.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace weft {
namespace {

// Connections from every particle to the one `rows` and `columns` away.
enum class Part { kAll, kEdge, kInside };

Connections connections(const Grid& grid, int rows, int columns, Part part = Part::kAll) {
  Connections out;
  for (int r = 0; r + rows < grid.rows; ++r) {
    for (int c = std::max(0, -columns); c < grid.columns && c + columns < grid.columns; ++c) {
      const bool edge = rows == 0 ? r == 0 || r == grid.rows - 1 : c == 0 || c == grid.columns - 1;
      if (part == Part::kAll || edge == (part == Part::kEdge))
        out.add(r * grid.columns + c, (r + rows) * grid.columns + c + columns);
    }
  }
  return out;
}

LatticeConstants constants(const RawTextile& raw, double h, bool) {
  const double clamp = raw.clamp.value_or(raw.stretch);
  const double rigidity = 1.5 * raw.bend / h;  // k_b = 2/3 B h, solved for B
  return {1.0,      raw.stretch, raw.stretch, raw.shear, raw.bend, raw.bend,
          raw.bend, clamp,       clamp,       clamp,     rigidity, rigidity};
}

// An interlaced connection of strip width h bends like a beam of rigidity B h when k_b = 2/3 B h;
// diagonals carry 2/9 of the mean rigidity along each axis.
LatticeConstants constants(const MeasuredTextile& textile, double h, bool diagonal_bend) {
  const double warp = textile.bend_rigidity_warp, weft = textile.bend_rigidity_weft;
  const double carried = diagonal_bend ? 2.0 / 9 * (warp + weft) / 2 : 0;
  return {0.5,
          textile.tensile_warp,
          textile.tensile_weft,
          2 * textile.shear,
          std::max(0.0, 2.0 / 3 * warp - carried) * h,
          std::max(0.0, 2.0 / 3 * weft - carried) * h,
          2 * carried * h / std::numbers::sqrt2,
          textile.tensile_warp,
          textile.tensile_weft,
          2 * textile.shear,
          warp,
          weft};
}

void add_stretch(Mesh& mesh, const Grid& grid, int rows, int columns, double k, double edge_share,
                 bool pushes) {
  const auto add = [&](Part part, double share) {
    mesh.families.push_back({FamilyKind::kStretch, grid.spacing, k * share, std::nullopt,
                             connections(grid, rows, columns, part), pushes});
  };
  if (edge_share == 1) return add(Part::kAll, 1);
  add(Part::kInside, 1);
  add(Part::kEdge, edge_share);
}

void add_bend(Mesh& mesh, const Grid& grid, const ChoiKo& law, int rows, int columns, double k_b,
              double c_b, double edge_share) {
  const bool diagonal = rows != 0 && columns != 0;
  const double length = grid.spacing * std::hypot(rows, columns);
  const auto add = [&](Part part, double share) {
    Family& family = mesh.families.emplace_back(
        Family{diagonal ? FamilyKind::kDiagonalBend : FamilyKind::kBend, length, 0, std::nullopt,
               connections(grid, rows, columns, part)});
    // max(f_b, c_b (l - L)) is 0 where either constant is
    if (k_b > 0 && c_b > 0) family.bend = BendingForce(law, k_b * share, c_b * share, length);
  };
  if (edge_share == 1 || diagonal) return add(Part::kAll, 1);
  add(Part::kInside, 1);
  add(Part::kEdge, edge_share);
}

// Bergou et al. 2006 on a lattice: B / 2 |x_(i-1) - 2 x_i + x_(i+1)|^2 w / h^3 along each axis, w
// the width of the strip, and B_t |x_00 - x_01 - x_10 + x_11|^2 / h^2 for the twist of a cell.
void add_stencils(Mesh& mesh, const Grid& grid, const LatticeConstants& k) {
  const IsometricStiffness stiffness = isometric_stiffness(k, grid.spacing);
  const auto add_axis = [&](int rows, int columns, double inside) {
    for (const Part part : {Part::kInside, Part::kEdge}) {
      const double share = part == Part::kEdge ? k.edge_share : 1;
      for (const auto& [i, j] : connections(grid, rows, columns, part))
        mesh.stencils.push_back({{i, (i + j) / 2, j, j}, {1, -2, 1, 0}, inside * share});
    }
  };
  add_axis(0, 2, stiffness.warp);
  add_axis(2, 0, stiffness.weft);
  for (const auto& [i, j] : connections(grid, 1, 1))
    mesh.stencils.push_back({{i, i + 1, j - 1, j}, {1, -1, -1, 1}, stiffness.twist});
  std::erase_if(mesh.stencils, [](const Stencil& stencil) { return stencil.stiffness == 0; });
}

}  // namespace

LatticeConstants lattice_constants(const SheetDefinition& sheet) {
  const ChoiKo* law = std::get_if<ChoiKo>(&sheet.bending);
  const bool diagonal_bend = law != nullptr && law->diagonal_bend;
  return std::visit(
      [&](const auto& textile) { return constants(textile, sheet.spacing(), diagonal_bend); },
      sheet.textile.model);
}

IsometricStiffness isometric_stiffness(const LatticeConstants& constants, double spacing) {
  // width of a strip: the spacing; 2 B_t: the sum of both rigidities
  const double square = spacing * spacing;
  return {constants.rigidity_warp / square, constants.rigidity_weft / square,
          (constants.rigidity_warp + constants.rigidity_weft) / square};
}

Mesh make_lattice(const SheetDefinition& sheet) {
  const Grid& grid = grid_of(sheet);
  const double h = grid.spacing;
  const ChoiKo* choi_ko = std::get_if<ChoiKo>(&sheet.bending);
  const bool diagonal_bend = choi_ko != nullptr && choi_ko->diagonal_bend;
  const LatticeConstants k = lattice_constants(sheet);

  Mesh mesh;
  mesh.damping = sheet.textile.damping.value_or(kDefaultDamping);

  // mass and drag: of the area that belongs to a particle, or one for all
  mesh.mass.resize(sheet.particle_count());
  const bool drags =
      std::visit([](const auto& model) { return model.air_drag > 0; }, sheet.textile.model);
  if (drags) mesh.drag.resize(sheet.particle_count());
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.columns; ++c) {
      const int i = r * grid.columns + c;
      if (const auto* raw = std::get_if<RawTextile>(&sheet.textile.model)) {
        mesh.mass[i] = raw->particle_mass;
        if (drags) mesh.drag[i] = raw->air_drag;
      } else {
        const auto& measured = std::get<MeasuredTextile>(sheet.textile.model);
        const double share =
            (r == 0 || r == grid.rows - 1 ? 0.5 : 1) * (c == 0 || c == grid.columns - 1 ? 0.5 : 1);
        mesh.mass[i] = measured.areal_density * h * h * share;
        if (drags) mesh.drag[i] = measured.air_drag * h * h * share;
      }
    }
  }

  const bool pushes = resists_compression(sheet.bending);
  add_stretch(mesh, grid, 0, 1, k.stretch_warp, k.edge_share, pushes);
  add_stretch(mesh, grid, 1, 0, k.stretch_weft, k.edge_share, pushes);
  for (const int columns : {1, -1})
    mesh.families.push_back({FamilyKind::kShear, h * std::numbers::sqrt2, k.shear, std::nullopt,
                             connections(grid, 1, columns)});
  if (choi_ko == nullptr) {
    add_stencils(mesh, grid, k);
  } else {
    add_bend(mesh, grid, *choi_ko, 0, 2, k.bend_warp, k.clamp_warp, k.edge_share);
    add_bend(mesh, grid, *choi_ko, 2, 0, k.bend_weft, k.clamp_weft, k.edge_share);
    if (diagonal_bend)
      for (const int columns : {2, -2})
        add_bend(mesh, grid, *choi_ko, 2, columns, k.bend_diagonal, k.clamp_diagonal, k.edge_share);
  }
  // what pulls at nothing is not there
  std::erase_if(mesh.families, [&](const Family& family) {
    const bool idle = family.stiffness == 0 && !family.bend && mesh.damping == 0;
    return idle || family.connections.empty();
  });

  mesh.triangles = triangles_of(grid);
  return mesh;
}

}  // namespace weft

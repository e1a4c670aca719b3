#pragma once

#include "core/model/mesh.h"

namespace weft {

// Precondition: the sheet is a grid, here and below.
inline const Grid& grid_of(const SheetDefinition& sheet) { return std::get<Grid>(sheet.shape); }

// Constants of a textile on a lattice, inside it. Connections that lie along an edge have
// edge_share of them: half of the sheet is missing there.
struct LatticeConstants {
  double edge_share;
  double stretch_warp, stretch_weft, shear;       // N/m
  double bend_warp, bend_weft, bend_diagonal;     // k_b, N m^2
  double clamp_warp, clamp_weft, clamp_diagonal;  // c_b, N/m
  double rigidity_warp, rigidity_weft;            // B, N m
};
LatticeConstants lattice_constants(const SheetDefinition& sheet);

// Stiffness of the isometric law's stencils inside a lattice, N/m.
struct IsometricStiffness {
  double warp, weft, twist;
};
IsometricStiffness isometric_stiffness(const LatticeConstants& constants, double spacing);

Mesh make_lattice(const SheetDefinition& sheet);

}  // namespace weft

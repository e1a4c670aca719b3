#pragma once

#include <cstdint>
#include <vector>

#include "core/simulation.h"

namespace weft::testing {

// Cloth that bends and stretches easily.
Textile soft_cloth(double friction = 0.3);
// Sheets of it, lattices and triangles; lengths in m.
SheetDefinition soft_lattice(int rows, int columns, double spacing = 0.01);
SheetDefinition soft_rectangle(double length, double width, double spacing = 0.01);
// With cloth contact.
Scene touching(const std::vector<SheetDefinition>& sheets);

// Columns of all particles, in the order of sheets.
std::vector<Matrix3Xd> by_sheet(const Simulation& simulation, const Matrix3Xd& all);
std::int64_t cuts_now(const Simulation& simulation);

}  // namespace weft::testing

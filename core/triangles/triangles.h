#pragma once

#include <vector>

#include "core/model/mesh.h"

namespace weft {

// Precondition: the sheet is of triangles, here and below.
inline const TriangleMesh& triangles_in(const SheetDefinition& sheet) {
  return *std::get<Triangles>(sheet.shape);
}

// The textile of a panel.
const Textile& textile_of(const SheetDefinition& sheet, int panel);

// Particles of each closed border, one after the other.
std::vector<std::vector<int>> borders_of(const TriangleMesh& mesh);

// Of all panels, kg/m^2. Precondition: textiles are measured.
double least_density(const SheetDefinition& sheet);

// A membrane and fitted curvatures, with edges that damp; or, by ChoiKo, connections.
Mesh make_triangles(const SheetDefinition& sheet);

}  // namespace weft

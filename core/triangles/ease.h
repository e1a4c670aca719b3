#pragma once

#include "core/model/mesh.h"

namespace weft {

// Gives a mesh, made of the sheet, a rest shape between that of its start (share 0) and its flat
// one (1). A triangle that the symmetric matrix S, along warp and weft, stretches at the start has
// no strain where S^(1 - share) does; it is softer by the square of its largest stretch, so that
// what lies along seams draws panels together without tearing at them. Threads that start shorter
// than 70 % of their length start strained. Curvature resists as on a mesh that is stretched so,
// folds turn from where they start, on the shorter way. Precondition: the sheet is of triangles.
void ease(const SheetDefinition& sheet, double share, Mesh& mesh);

// Which triangles start stretched by half or more: those along seams that are to close.
std::vector<bool> stretched_at_start(const SheetDefinition& sheet);

}  // namespace weft

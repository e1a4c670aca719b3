#pragma once

#include <string>
#include <vector>

#include "core/contact/moving_bodies.h"
#include "core/model/mesh.h"

namespace weft {

// A border of sewn cloth that goes around no body: of a sleeve, a leg or a strap beside it.
struct LooseBorder {
  double length = 0;  // m
  std::string panel;  // with most of it
};

// Borders of a sheet of triangles with more than one, as a skirt has two and a shirt four. One goes
// around a body if it gets stuck where it is drawn tight over it, or if a line along it in the
// cloth does, for cloth may be longer than a body. Small holes, of less than 0.25 m, are not meant.
// x: (3 x particles) m; bodies: placed for `time`.
std::vector<LooseBorder> loose_borders(const Scene& scene, const MovingBodies& bodies,
                                       const SheetDefinition& sheet, const Matrix3Xd& x,
                                       double time);

}  // namespace weft

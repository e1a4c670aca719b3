#pragma once

#include "core/triangles/cut.h"

namespace weft::testing {

// A square of that width, m.
inline RestShape square(Cut cut, double width, double spacing) {
  return cut_rectangle(cut, width, width, spacing);
}

// A square of so many points along each side, scattered and joined as Delaunay does: of any
// valence.
RestShape scattered(int columns, double spacing);

// The longest Verlet step at which a small disturbance about x does not grow, forces there taken
// away, by bisection. s
double measured_step(const Mesh& mesh, const Matrix3Xd& x);

}  // namespace weft::testing

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

}  // namespace weft::testing

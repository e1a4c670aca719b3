#pragma once

#include "core/triangles/cut.h"

namespace weft::testing {

// A square of that width, m.
inline RestShape square(Cut cut, double width, double spacing) {
  return cut_rectangle(cut, width, width, spacing);
}

}  // namespace weft::testing

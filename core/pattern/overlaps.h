#pragma once

#include <vector>

#include "core/pattern/borders.h"
#include "core/pattern/panel_mesher.h"
#include "core/pattern/pattern.h"

namespace weft {

// Two panels that are placed into each other in one plane.
struct Overlap {
  std::size_t first = 0, second = 0;
  double depth = 0;  // by which they come apart, m
};

// Panels that are placed in one plane and overlap there cannot be told which lies outside: they are
// moved apart within it, each half of the way, along the line of their middles. Those that lie
// middle on middle stay. Tells what overlapped, and changes `origins`, m.
// Precondition: a mesh and an origin for each panel.
std::vector<Overlap> draw_apart(const Pattern& pattern, const std::vector<PanelMesh>& meshes,
                                std::vector<Vector3d>& origins);

}  // namespace weft

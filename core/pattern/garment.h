#pragma once

#include <string>
#include <variant>
#include <vector>

#include "core/pattern/pattern.h"
#include "core/plan.h"

namespace weft {

// An edge of a pattern in the sheet made of it.
struct GarmentEdge {
  int panel = 0, edge = 0;
  std::vector<int> particles;  // from its start to its end
  double length = 0;           // m
};

// A crease of a panel in the sheet.
struct GarmentCrease {
  int panel = 0, crease = 0;
  std::vector<int> particles;  // from its first point to its last
};

// A pattern cut into triangles and sewn.
struct Garment {
  // Particles start where the placed panels have them, those that are sewn together in the mean of
  // their places. The flat shape is the pattern; panels that seams turn over are mirrored in u.
  TriangleMesh mesh;
  std::vector<GarmentEdge> edges;  // panel after panel
  std::vector<GarmentCrease> creases;
  std::vector<Warning> notes;
  double least_height = 0;  // of the flat shape, m
};

// Cuts panels into triangles with edges about that long, m, and sews them; or all that is in the
// way, by its path, which begins with `field`, or of the length is `edge_field`.
std::variant<Garment, std::vector<Problem>> build_garment(const Pattern& pattern, double edge,
                                                          const std::string& field,
                                                          const std::string& edge_field);

}  // namespace weft

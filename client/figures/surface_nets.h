#pragma once

#include <array>
#include <functional>
#include <vector>

#include "client/imports/imported_mesh.h"

namespace weft::client {

// A closed surface, anticlockwise seen from outside, m.
struct FigureMesh {
  std::vector<Vector3d> vertices;
  Triangles triangles;
};

// Where a function is 0 that is negative inside (surface nets: Gibson 1998), from values at the
// corners of cubic cells; positive around, and nowhere more than twice the distance from there, by
// which most corners are passed over. Gaps that a cell does not resolve are filled. The function is
// called by several threads at once.
FigureMesh surface_of(const std::function<double(const Vector3d&)>& function, const Vector3d& low,
                      const Vector3d& high, double cell);

// Evens out what cells left, without shrinking (Taubin 1995).
void smooth(FigureMesh& mesh, int rounds);

}  // namespace weft::client

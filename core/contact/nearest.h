#pragma once

#include <array>

#include "core/model/shape.h"

namespace weft {

// Weights of a triangle's corners in its point that is nearest to p.
std::array<double, 3> nearest_in_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                                          const Vector3d& c);

// Shares of the way from a to b and from c to d at which these edges are nearest to each other.
std::array<double, 2> nearest_on_edges(const Vector3d& a, const Vector3d& b, const Vector3d& c,
                                       const Vector3d& d);

}  // namespace weft

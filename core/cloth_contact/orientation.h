#pragma once

#include "core/model/shape.h"

namespace weft {

// On which side of the plane through a, b and c the point d lies: 1 where they turn anticlockwise
// as it sees them, -1 on the other side, 0 in the plane. Exact.
int orientation(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d);

// Whether the edge from p to q passes through the triangle a, b, c. Exact; touching it with an end
// is no passing, and of triangles that close around a common edge or corner a way through that
// passes exactly one.
bool cuts(const Vector3d& p, const Vector3d& q, const Vector3d& a, const Vector3d& b,
          const Vector3d& c);

}  // namespace weft

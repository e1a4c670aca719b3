#pragma once

#include <functional>
#include <vector>

#include "core/contact/body.h"

namespace weft::testing {

// A ball: an icosahedron of which every triangle was cut in four so many times.
BodyMesh ball_mesh(double radius, int cuts);

// 12 triangles around the origin, turned.
BodyMesh box_mesh(const Vector3d& half_size, const Quaterniond& turn = Quaterniond::Identity());

// Both, not joined.
BodyMesh together(BodyMesh one, const BodyMesh& other, const Vector3d& moved);

// A collider for sheets with skins up to 1 cm. Precondition: make_body() takes the mesh.
Collider solid(const BodyMesh& mesh, double friction = 0.3);

// Corner k of a triangle, m.
Vector3d corner_of(const BodyMesh& mesh, const std::array<int, 3>& triangle, std::size_t k);

// From all triangles and by solid angles: slow, and nothing else, m.
double signed_distance(const BodyMesh& mesh, const Vector3d& point);

// Where a vertex is at a time.
using Way = std::function<Vector3d(const Vector3d& vertex, double time)>;
// A collider with a pose for each of the times, for sheets with skins up to 1 mm.
Collider posed(const BodyMesh& mesh, const std::vector<double>& times, const Way& way,
               double cell = 5e-3, double friction = 0.3);
// Its mesh between two poses: every vertex on its straight way.
BodyMesh mesh_at(const Collider& body, double time);

}  // namespace weft::testing

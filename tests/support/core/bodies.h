#pragma once

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

}  // namespace weft::testing

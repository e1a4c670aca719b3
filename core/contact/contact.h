#pragma once

#include <span>

#include "core/model/mesh.h"

namespace weft {

// Signed distance of a point from a body (m, negative inside) and the direction out of it.
struct Distance {
  double value;
  Vector3d normal;
};

// Distances at the body's start place.
Distance distance(const Plane& plane, const Vector3d& point);
Distance distance(const Sphere& sphere, const Vector3d& point);
Distance distance(const Box& box, const Vector3d& point);
Distance distance(const Capsule& capsule, const Vector3d& point);
Distance distance(const Collider& collider, const Vector3d& point, double time);

// Puts every free particle that came closer than `skin` (m) to a collider back to the skin, takes
// away its approach (inelastic), and slows its sliding by Coulomb's law. time: s, at the end of the
// step dt; friction: of the textile; inverse_mass: (n) 0 for held particles; x: positions, m; d:
// displacements of the step, m (3 x n).
void resolve_contacts(std::span<const Collider> colliders, double friction, double skin,
                      double time, double dt, const VectorXd& inverse_mass, Matrix3Xd& x,
                      Matrix3Xd& d);

}  // namespace weft

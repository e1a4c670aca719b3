#pragma once

#include "core/model/mesh.h"

namespace weft {

// Velocity of the air at a time, m/s.
Vector3d air_velocity(const Wind& wind, double time);

// Adds the force of moving air on every triangle, a third to each corner:
// F = 1/2 rho A |v_n| v_n n + c_t A v_t, v = air minus facet velocity. x: m; v: m/s; force: N; (3 x
// n). give: the speed that a pressure gives cloth before v tells of it, m/s per Pa, or 0; F is that
// of the velocity it has by then, to first order.
void add_wind_forces(const Wind& wind, const Mesh& mesh, double time, double give,
                     const Matrix3Xd& x, const Matrix3Xd& v, Matrix3Xd& force);

}  // namespace weft

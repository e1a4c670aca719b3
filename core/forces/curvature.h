#pragma once

#include "core/model/mesh.h"

namespace weft {

// Quadratic bending energy, per area (B_u |x_uu|^2 + B_v |x_vv|^2 + 2 B_t |x_uv|^2) / 2: that of a
// plate in the directions of its normal, which has no other preferred direction of the mesh, unlike
// hinges. x: (3 x particles) m. J, and N added to `force`.
double curvature_energy(const Surface& surface, const Matrix3Xd& x);
void add_curvature_forces(const Surface& surface, const Matrix3Xd& x, Matrix3Xd& force);

// Stiffness of x_uu, x_uv and x_vv of a fit, N m^3.
Vector3d fit_stiffness(const Surface& surface, const CurvatureFit& fit);

}  // namespace weft

#pragma once

#include <vector>

#include "core/triangles/rest_shape.h"

namespace weft {

// Bending rigidity of a sheet, N m. Twist: the mean of warp and weft in a sheet without cross
// contraction.
struct BendStiffness {
  double warp = 0, weft = 0, twist = 0;
};

// Second derivatives of positions over (u, v) at a particle, x_uu, x_uv and x_vv: sums of the
// positions around it by these weights, 1/m^2.
struct CurvatureFit {
  std::vector<int> particle;                  // the first is its own
  std::vector<std::array<double, 3>> weight;  // uu, uv, vv
  double area = 0;                            // m^2
};

// By least squares of a quadratic through each particle over its ring of neighbours, or two rings
// at the border and where there are fewer than six.
std::vector<CurvatureFit> fit_curvature(const RestShape& shape);

// Quadratic bending energy, per area (B_u |x_uu|^2 + B_v |x_vv|^2 + 2 B_t |x_uv|^2) / 2: that of a
// plate in the directions of its normal, which has no other preferred direction of the mesh, unlike
// hinges. x: (3 x particles) m. J, and N added to `force`.
double curvature_energy(const std::vector<CurvatureFit>& fits, const BendStiffness& stiffness,
                        const Matrix3Xd& x);
void add_curvature_forces(const std::vector<CurvatureFit>& fits, const BendStiffness& stiffness,
                          const Matrix3Xd& x, Matrix3Xd& force);

}  // namespace weft

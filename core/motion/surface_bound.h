#pragma once

#include <vector>

#include "core/model/mesh.h"

namespace weft {

// Strain of threads up to which the linear bound of triangles holds: St Venant-Kirchhoff's law
// stiffens where it is stretched.
inline constexpr double kBoundStrain = 0.05;

// Upper bound of what particles resist a motion by, N/m, for every shape whose threads are strained
// by no more than `strain`: matrices of triangles are bounded by diagonal ones, rows of fitted
// curvatures by their sums.
struct SurfaceBound {
  VectorXd membrane, bend;
};
SurfaceBound surface_bound(const Mesh& mesh, double strain);
// With a strain of each triangle.
SurfaceBound surface_bound(const Mesh& mesh, const VectorXd& strains);

// Steps in which a triangle alone would be stable, s, with the mass that its corners have of it.
std::vector<double> triangle_steps(const Mesh& mesh, double strain);

}  // namespace weft

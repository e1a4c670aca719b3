#pragma once

#include <vector>

#include "core/model/mesh.h"

namespace weft {

// Strain of threads up to which the linear bound of triangles holds: St Venant-Kirchhoff's law
// stiffens where it is stretched.
inline constexpr double kBoundStrain = 0.05;

// Upper bound of what a triangle resists a motion of its corners by, N/m, for every shape whose
// threads are strained by no more than `strain`: the largest eigenvalue of its stiffness matrix.
// With F = [U V] and y_i = F^T x_i, |y_i| <= (1 + strain) |x_i|, its material part is that of the
// flat triangle times (1 + strain)^2, its geometric part at most the largest stress times a
// Laplacian.
double stiffness_bound(const MembraneElement& element, const MembraneStiffness& stiffness,
                       double strain);

// The same for each particle, N/m: matrices of triangles are bounded by diagonal ones, rows of
// fitted curvatures by their sums.
struct SurfaceBound {
  VectorXd membrane, bend;
};
SurfaceBound surface_bound(const Mesh& mesh, double strain);
// With a strain of each triangle.
SurfaceBound surface_bound(const Mesh& mesh, const VectorXd& strains);

// Steps in which a triangle alone would be stable, s, with the mass that its corners have of it.
std::vector<double> triangle_steps(const Mesh& mesh, double strain);

}  // namespace weft

#pragma once

#include "core/model/mesh.h"

namespace weft {

// Adds the forces of all connections: stretch and shear (eq. 2), bending (eq. 3 to 5), damping (eq.
// 7, where mesh.damping > 0). x: positions, m; v: velocities, m/s, read only for damping; force: N.
// (3 x n)
void add_spring_forces(const Mesh& mesh, const Matrix3Xd& x, const Matrix3Xd& v, Matrix3Xd& force);

// Elastic energy of the connections, J.
double spring_energy(const Mesh& mesh, const Matrix3Xd& x);

// Largest (l - L) / L of the stretch connections, 0 where none is stretched.
double largest_spring_strain(const Mesh& mesh, const Matrix3Xd& x);

// Adds the forces of the isometric bending law (Bergou et al. 2006).
void add_isometric_forces(const Mesh& mesh, const Matrix3Xd& x, Matrix3Xd& force);

double isometric_energy(const Mesh& mesh, const Matrix3Xd& x);

}  // namespace weft

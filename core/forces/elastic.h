#pragma once

#include "core/model/mesh.h"

namespace weft {

// All that a sheet resists deformation by, and the damping of its connections. x, v, force:
// (3 x particles) m, m/s, N.
void add_elastic_forces(const Mesh& mesh, const Matrix3Xd& x, const Matrix3Xd& v, Matrix3Xd& force);
// Of these, what changes as fast as a sheet stretches: all but the isometric law's bending.
void add_fast_forces(const Mesh& mesh, const Matrix3Xd& x, const Matrix3Xd& v, Matrix3Xd& force);

// J
double elastic_energy(const Mesh& mesh, const Matrix3Xd& x);

// Of stretch connections, and of the threads of triangles: l / L - 1, 0 where none is stretched.
double largest_strain(const Mesh& mesh, const Matrix3Xd& x);

}  // namespace weft

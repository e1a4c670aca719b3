#pragma once

#include "core/model/mesh.h"

namespace weft {

// Steps up to which the linearized motion of a sheet does not grow, s; infinity where nothing
// limits.
struct StableStep {
  double linear_bound = 0;   // for every shape; 0: the integrator has none
  double estimate = 0;       // for the present shape
  double damping_ratio = 0;  // of the stiffest mode, 1 is critical
};

// With K and C the stiffness and damping matrices, Verlet with extrapolated damping is stable while
// dt^2 K + 4 dt C < 4 M. The bound replaces K by the graph Laplacian of the largest stiffness of
// each connection, whatever its direction; the estimate takes the Jacobian at x. air_rate: damping
// by wind, 1/s. x: (3 x n) m.
StableStep stable_step(const Mesh& mesh, const VectorXd& inverse_mass, IntegratorKind integrator,
                       double air_rate, const Matrix3Xd& x);

}  // namespace weft

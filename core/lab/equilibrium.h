#pragma once

#include <stop_token>

#include "core/model/mesh.h"

namespace weft {

struct Equilibrium {
  Matrix3Xd x;          // (3 x particles) m
  double residual = 0;  // largest net force on a free particle, N
  int iterations = 0;
  bool found = false;  // residual <= tolerance
};

// Where a sheet comes to rest: a minimum of elastic energy and potential in gravity near `start`,
// by Newton's method without any step in time. held: (particles) 1 keeps its start position.
// tolerance: N. Ends early, not found, on a stop.
Equilibrium find_equilibrium(const Mesh& mesh, const Eigen::ArrayXi& held, const Vector3d& gravity,
                             const Matrix3Xd& start, double tolerance,
                             const std::stop_token& stop = {});

}  // namespace weft

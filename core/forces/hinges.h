#pragma once

#include <span>

#include "core/model/mesh.h"

namespace weft {

// Energy 4 k (1 - cos((phi - angle) / 2)) of each hinge, of which phi is the angle now: near rest
// k (phi - angle)^2 / 2, and never weaker the farther it is turned. x: (3 x particles) m. J, and N
// added to `force`.
double hinge_energy(std::span<const Hinge> hinges, const Matrix3Xd& x);
void add_hinge_forces(std::span<const Hinge> hinges, const Matrix3Xd& x, Matrix3Xd& force);

// rad, within pi; 0 where a side has no area.
double angle_of(const Hinge& hinge, const Matrix3Xd& x);

// A bound of the second derivative of a hinge's energy by its angle, N m, where the slopes of the
// angle are those of the flat shape.
double stiffness_bound(const Hinge& hinge);

}  // namespace weft

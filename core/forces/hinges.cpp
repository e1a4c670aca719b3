#include "core/forces/hinges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace weft {
namespace {

constexpr double kSteepest = 2;  // slopes of the angle, over those in the flat shape

struct HingeSides {
  Vector3d edge, normals[2];  // m, m^2

  HingeSides(const Hinge& hinge, const Matrix3Xd& x)
      : edge(x.col(hinge.particle[1]) - x.col(hinge.particle[0])),
        normals{edge.cross(x.col(hinge.particle[2]) - x.col(hinge.particle[0])),
                (x.col(hinge.particle[3]) - x.col(hinge.particle[0])).cross(edge)} {}

  double angle() const {
    if (normals[0].squaredNorm() == 0 || normals[1].squaredNorm() == 0) return 0;
    const double sine = normals[1].cross(normals[0]).dot(edge) / edge.norm();
    return std::atan2(sine, normals[0].dot(normals[1]));
  }
  // Out of rest, on the shorter way.
  double turned(const Hinge& hinge) const {
    return std::remainder(angle() - hinge.angle, 2 * std::numbers::pi);
  }
};

}  // namespace

double hinge_energy(std::span<const Hinge> hinges, const Matrix3Xd& x) {
  double energy = 0;
  for (const Hinge& hinge : hinges)
    energy += 4 * hinge.stiffness * (1 - std::cos(HingeSides(hinge, x).turned(hinge) / 2));
  return energy;
}

void add_hinge_forces(std::span<const Hinge> hinges, const Matrix3Xd& x, Matrix3Xd& force) {
  for (const Hinge& hinge : hinges) {
    const HingeSides sides(hinge, x);
    const double moment = 2 * hinge.stiffness * std::sin(sides.turned(hinge) / 2);
    if (moment == 0) continue;
    const double length = sides.edge.norm();
    for (std::size_t side = 0; side < 2; ++side) {
      const int tip = hinge.particle[2 + side], first = hinge.particle[0];
      const Vector3d& normal = sides.normals[side];
      const double twice_area = normal.norm();
      // a side that has collapsed is turned no harder
      const double slope = std::min(length / twice_area, kSteepest * hinge.slope[2 + side]);
      const Vector3d push = normal * (-moment * slope / twice_area);
      const double along = (x.col(tip) - x.col(first)).dot(sides.edge) / (length * length);
      force.col(tip) += push;
      force.col(first) -= (1 - along) * push;
      force.col(hinge.particle[1]) -= along * push;
    }
  }
}

double angle_of(const Hinge& hinge, const Matrix3Xd& x) { return HingeSides(hinge, x).angle(); }

double stiffness_bound(const Hinge& hinge) { return kSteepest * kSteepest * hinge.stiffness; }

}  // namespace weft

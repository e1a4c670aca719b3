#include "core/forces/air.h"

#include <cmath>
#include <numbers>

namespace weft {

Vector3d air_velocity(const Wind& wind, double time) {
  return wind.velocity * (1 + wind.gust * std::sin(2 * std::numbers::pi * time / wind.gust_period));
}

void add_wind_forces(const Wind& wind, const Mesh& mesh, double time, double give,
                     const Matrix3Xd& x, const Matrix3Xd& v, Matrix3Xd& force) {
  const Vector3d air = air_velocity(wind, time);
  for (const auto& [a, b, c] : mesh.triangles) {
    // |cross| is twice the area
    const Vector3d cross = Vector3d(x.col(b) - x.col(a)).cross(Vector3d(x.col(c) - x.col(a)));
    const double twice_area = cross.norm();
    if (twice_area == 0) continue;
    const Vector3d normal = cross / twice_area;
    const Vector3d relative = air - (v.col(a) + v.col(b) + v.col(c)) / 3;
    const double along = relative.dot(normal);
    const double felt = along / (1 + give * wind.air_density / 2 * std::abs(along));
    const Vector3d corner_force =
        twice_area / 6 *
        (wind.air_density / 2 * std::abs(felt) * felt * normal +
         wind.tangential_drag / (1 + give * wind.tangential_drag) * (relative - along * normal));
    force.col(a) += corner_force;
    force.col(b) += corner_force;
    force.col(c) += corner_force;
  }
}

}  // namespace weft

#include "core/contact/nearest.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace weft {
namespace {

// The share of the way from `from` along `edge` that is nearest to a point `to` it.
double share_along(const Vector3d& edge, const Vector3d& to) {
  const double squared = edge.squaredNorm();
  return squared > 0 ? std::clamp(to.dot(edge) / squared, 0.0, 1.0) : 0;
}

}  // namespace

std::array<double, 3> nearest_in_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                                          const Vector3d& c) {
  const Vector3d ab = b - a, ac = c - a, ap = p - a, normal = ab.cross(ac);
  const double squared = normal.squaredNorm();
  if (squared > 0) {
    const double v = ap.cross(ac).dot(normal) / squared, w = ab.cross(ap).dot(normal) / squared;
    const double u = 1 - v - w;
    if (u >= 0 && v >= 0 && w >= 0) return {u, v, w};
  }

  // outside, or no triangle: on one of its edges
  const double on_ab = share_along(ab, ap), on_ac = share_along(ac, ap),
               on_bc = share_along(c - b, p - b);
  const double to_ab = (ap - on_ab * ab).squaredNorm(), to_ac = (ap - on_ac * ac).squaredNorm(),
               to_bc = (p - b - on_bc * (c - b)).squaredNorm();
  if (to_ab <= to_ac && to_ab <= to_bc) return {1 - on_ab, on_ab, 0};
  if (to_ac <= to_bc) return {1 - on_ac, 0, on_ac};
  return {0, 1 - on_bc, on_bc};
}

std::array<double, 2> nearest_on_edges(const Vector3d& a, const Vector3d& b, const Vector3d& c,
                                       const Vector3d& d) {
  constexpr double kParallel = 1e-12;  // squared sine, where any share will do
  const Vector3d u = b - a, v = d - c, w = a - c;
  const double uu = u.squaredNorm(), uv = u.dot(v), vv = v.squaredNorm(), uw = u.dot(w),
               vw = v.dot(w), sine = uu * vv - uv * uv;
  const double s =
      sine > kParallel * uu * vv ? std::clamp((uv * vw - vv * uw) / sine, 0.0, 1.0) : 0.5;
  const double t = share_along(v, w + s * u);
  return {share_along(u, t * v - w), t};
}

}  // namespace weft

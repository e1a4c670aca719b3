#include "core/forces/curvature.h"

namespace weft {
namespace {

// (3 x 3) x_uu, x_uv, x_vv, 1/m.
Eigen::Matrix3d curvature(const CurvatureFit& fit, const Matrix3Xd& x) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < fit.particle.size(); ++k)
    for (Eigen::Index d = 0; d < 3; ++d)
      sum.col(d) += fit.weight[k][static_cast<std::size_t>(d)] * x.col(fit.particle[k]);
  return sum;
}

}  // namespace

Vector3d fit_stiffness(const Surface& surface, const CurvatureFit& fit) {
  const BendStiffness& bend = surface.bend[static_cast<std::size_t>(fit.panel)];
  return fit.area * Vector3d(bend.warp, 2 * bend.twist, bend.weft);
}

double curvature_energy(const Surface& surface, const Matrix3Xd& x) {
  double energy = 0;
  for (const CurvatureFit& fit : surface.fits)
    energy += curvature(fit, x).colwise().squaredNorm().dot(fit_stiffness(surface, fit)) / 2;
  return energy;
}

void add_curvature_forces(const Surface& surface, const Matrix3Xd& x, Matrix3Xd& force) {
  for (const CurvatureFit& fit : surface.fits) {
    const Eigen::Matrix3d moment = curvature(fit, x) * fit_stiffness(surface, fit).asDiagonal();
    for (std::size_t k = 0; k < fit.particle.size(); ++k)
      force.col(fit.particle[k]) -=
          moment * Vector3d(fit.weight[k][0], fit.weight[k][1], fit.weight[k][2]);
  }
}

}  // namespace weft

#include "core/triangles/curvature.h"

#include <Eigen/SVD>
#include <algorithm>
#include <map>

namespace weft {
namespace {

// Neighbours of a particle, and how far they lie from it in (u, v), m.
using Ring = std::map<int, Vector2d>;

std::vector<Ring> rings(const RestShape& shape) {
  std::vector<Ring> all(static_cast<std::size_t>(shape.particles));
  for (std::size_t t = 0; t < shape.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      for (const std::size_t l : {(k + 1) % 3, (k + 2) % 3})
        all[static_cast<std::size_t>(shape.triangles[t][k])].emplace(
            shape.triangles[t][l], shape.corners[t][l] - shape.corners[t][k]);
  return all;
}

// With the neighbours of its neighbours.
Ring widened(const std::vector<Ring>& all, int particle) {
  const Ring& near = all[static_cast<std::size_t>(particle)];
  Ring wide = near;
  for (const auto& [j, offset] : near)
    for (const auto& [k, further] : all[static_cast<std::size_t>(j)])
      if (k != particle) wide.emplace(k, offset + further);
  return wide;
}

CurvatureFit fit(int particle, const Ring& near) {
  const auto count = static_cast<Eigen::Index>(near.size());
  double mean = 0;  // distance, by which all lengths are divided
  for (const auto& [j, offset] : near) mean += offset.norm() / static_cast<double>(count);

  Eigen::MatrixXd terms(count, 5);
  VectorXd weights(count);
  Eigen::Index row = 0;
  for (const auto& [j, offset] : near) {
    constexpr double kNearest = 0.3;
    const Vector2d d = offset / mean;
    weights[row] = 1 / std::pow(std::max(d.norm(), kNearest), 2);
    terms.row(row++) << d.x(), d.y(), d.x() * d.x() / 2, d.x() * d.y(), d.y() * d.y() / 2;
  }
  Eigen::JacobiSVD<Eigen::MatrixXd> svd(weights.asDiagonal() * terms,
                                        Eigen::ComputeThinU | Eigen::ComputeThinV);
  svd.setThreshold(1e-6);
  const Eigen::MatrixXd solution = svd.solve(Eigen::MatrixXd(weights.asDiagonal()));  // (5 x count)

  CurvatureFit made;
  made.particle.push_back(particle);
  made.weight.push_back({0, 0, 0});
  row = 0;
  for (const auto& [j, offset] : near) {
    auto& weight = made.weight.emplace_back();
    made.particle.push_back(j);
    for (std::size_t k = 0; k < 3; ++k) {
      weight[k] = solution(2 + static_cast<Eigen::Index>(k), row) / (mean * mean);
      made.weight[0][k] -= weight[k];
    }
    ++row;
  }
  return made;
}

// (3 x 3) x_uu, x_uv, x_vv, 1/m.
Eigen::Matrix3d curvature(const CurvatureFit& fit, const Matrix3Xd& x) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < fit.particle.size(); ++k)
    for (Eigen::Index d = 0; d < 3; ++d)
      sum.col(d) += fit.weight[k][static_cast<std::size_t>(d)] * x.col(fit.particle[k]);
  return sum;
}

Vector3d scaled(const BendStiffness& stiffness, double area) {
  return area * Vector3d(stiffness.warp, 2 * stiffness.twist, stiffness.weft);
}

}  // namespace

std::vector<CurvatureFit> fit_curvature(const RestShape& shape) {
  constexpr std::size_t kEnough = 6;
  const std::vector<Ring> all = rings(shape);
  const std::vector<bool> on_border = border(shape);
  const VectorXd area = areas(shape);
  std::vector<CurvatureFit> fits;
  for (int i = 0; i < shape.particles; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const bool wide = on_border[k] || all[k].size() < kEnough;
    fits.push_back(fit(i, wide ? widened(all, i) : all[k]));
    fits.back().area = area[i];
  }
  return fits;
}

double curvature_energy(const std::vector<CurvatureFit>& fits, const BendStiffness& stiffness,
                        const Matrix3Xd& x) {
  double energy = 0;
  for (const CurvatureFit& fit : fits)
    energy += curvature(fit, x).colwise().squaredNorm().dot(scaled(stiffness, fit.area)) / 2;
  return energy;
}

void add_curvature_forces(const std::vector<CurvatureFit>& fits, const BendStiffness& stiffness,
                          const Matrix3Xd& x, Matrix3Xd& force) {
  for (const CurvatureFit& fit : fits) {
    const Eigen::Matrix3d moment = curvature(fit, x) * scaled(stiffness, fit.area).asDiagonal();
    for (std::size_t k = 0; k < fit.particle.size(); ++k)
      force.col(fit.particle[k]) -=
          moment * Vector3d(fit.weight[k][0], fit.weight[k][1], fit.weight[k][2]);
  }
}

}  // namespace weft

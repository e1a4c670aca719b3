#include "core/triangles/ease.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/forces/hinges.h"
#include "core/forces/membrane.h"
#include "core/triangles/rest_shape.h"
#include "core/triangles/triangles.h"

namespace weft {
namespace {

using Eigen::Matrix2d;
constexpr double kShortest = 0.7;  // of a thread's length

// S^2 of a triangle, along warp and weft.
Eigen::SelfAdjointEigenSolver<Matrix2d> squared_stretch(const MembraneElement& element,
                                                        const Matrix3Xd& x) {
  const Threads thread = threads_of(element, x);
  Matrix2d squared;
  squared << thread.warp.squaredNorm(), thread.warp.dot(thread.weft), thread.warp.dot(thread.weft),
      thread.weft.squaredNorm();
  return Eigen::SelfAdjointEigenSolver<Matrix2d>(squared);
}

}  // namespace

std::vector<bool> stretched_at_start(const SheetDefinition& sheet) {
  constexpr double kStretch = 1.5;
  const Matrix3Xd x = start_positions(sheet);
  std::vector<bool> stretched;
  for (const MembraneElement& element : make_membrane(rest_shape(triangles_in(sheet))))
    stretched.push_back(squared_stretch(element, x).eigenvalues().maxCoeff() > kStretch * kStretch);
  return stretched;
}

void ease(const SheetDefinition& sheet, double share, Mesh& mesh) {
  const Matrix3Xd x = start_positions(sheet);
  VectorXd longest = VectorXd::Ones(x.cols());  // stretch around each particle
  for (MembraneElement& element : mesh.surface.membrane) {
    const auto start = squared_stretch(element, x);
    const Eigen::Vector2d stretch =
        start.eigenvalues().cwiseMax(kShortest * kShortest).array().pow((1 - share) / 2);
    const Matrix2d inverse = start.eigenvectors() * stretch.cwiseInverse().asDiagonal() *
                             start.eigenvectors().transpose();
    const double longest_thread = std::max(1.0, stretch.maxCoeff());
    element.area /= longest_thread * longest_thread;
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector2d gradient = inverse * Eigen::Vector2d(element.du[k], element.dv[k]);
      element.du[k] = gradient.x();
      element.dv[k] = gradient.y();
      double& most = longest[element.particle[k]];
      most = std::max(most, longest_thread);
    }
  }
  for (CurvatureFit& fit : mesh.surface.fits) {
    double most = 1;
    for (const int i : fit.particle) most = std::max(most, longest[i]);
    fit.area *= std::pow(most, -4);
  }
  for (Hinge& hinge : mesh.surface.hinges) {
    const double start = angle_of(hinge, x);
    hinge.angle = start + share * std::remainder(hinge.angle - start, 2 * std::numbers::pi);
  }
}

}  // namespace weft

#include "core/motion/surface_bound.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "core/forces/curvature.h"
#include "core/forces/hinges.h"

namespace weft {

namespace {

// R with R R the law of a material, N^(1/2) m^(-1/2).
Eigen::Matrix3d root_of(const MembraneStiffness& stiffness) {
  Eigen::Matrix3d law;
  law << stiffness.warp, stiffness.coupling, 0, stiffness.coupling, stiffness.weft, 0, 0, 0,
      stiffness.shear;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(law);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() *
         solver.eigenvectors().transpose();
}

std::vector<Eigen::Matrix3d> roots_of(const Surface& surface) {
  std::vector<Eigen::Matrix3d> roots;
  for (const MembraneStiffness& stiffness : surface.stretch) roots.push_back(root_of(stiffness));
  return roots;
}

// Upper bound of what a triangle resists a motion of its corners by, N/m: the largest eigenvalue of
// its stiffness matrix. With F = [U V] and y_i = F^T x_i, |y_i| <= (1 + strain) |x_i|, its material
// part is that of the flat triangle times (1 + strain)^2, its geometric part at most the largest
// stress times a Laplacian.
double stiffness_bound(const MembraneElement& element, const MembraneStiffness& stiffness,
                       const Eigen::Matrix3d& root, double strain) {
  double uu = 0, uv = 0, vv = 0;  // sums over the corners, 1/m^2
  for (std::size_t k = 0; k < 3; ++k) {
    uu += element.du[k] * element.du[k];
    uv += element.du[k] * element.dv[k];
    vv += element.dv[k] * element.dv[k];
  }
  // B^T C B has the eigenvalues of R (B B^T) R with C = R R
  Eigen::Matrix3d strains;
  strains << uu, 0, uv, 0, vv, uv, uv, uv, uu + vv;
  const Eigen::Matrix3d material = root * strains * root;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  const double material_most =
      solver.computeDirect(material, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
  const double laplacian = (uu + vv) / 2 + std::hypot((uu - vv) / 2, uv);
  const double green = strain + strain * strain / 2;
  const double stress =
      green * (std::max(stiffness.warp, stiffness.weft) + stiffness.coupling + 2 * stiffness.shear);
  constexpr double kRounding = 1 + 1e-9;  // of eigenvalues in closed form
  return kRounding * element.area *
         ((1 + strain) * (1 + strain) * material_most + stress * laplacian);
}

}  // namespace

SurfaceBound surface_bound(const Mesh& mesh, double strain) {
  const auto triangles = static_cast<Eigen::Index>(mesh.surface.membrane.size());
  return surface_bound(mesh, VectorXd::Constant(triangles, strain));
}

SurfaceBound surface_bound(const Mesh& mesh, const VectorXd& strains) {
  SurfaceBound bound{VectorXd::Zero(mesh.mass.size()), VectorXd::Zero(mesh.mass.size())};
  const Surface& surface = mesh.surface;
  const std::vector<Eigen::Matrix3d> roots = roots_of(surface);
  for (Eigen::Index t = 0; const MembraneElement& element : surface.membrane) {
    const auto panel = static_cast<std::size_t>(element.panel);
    const double most =
        stiffness_bound(element, surface.stretch[panel], roots[panel], strains[t++]);
    for (const int i : element.particle) bound.membrane[i] += most;
  }
  for (const CurvatureFit& fit : surface.fits) {
    const Vector3d stiffness = fit_stiffness(surface, fit);
    Vector3d sums = Vector3d::Zero();
    for (const auto& weight : fit.weight)
      sums += Vector3d(weight[0], weight[1], weight[2]).cwiseAbs();
    const Vector3d row = stiffness.cwiseProduct(sums);
    for (std::size_t k = 0; k < fit.particle.size(); ++k)
      bound.bend[fit.particle[k]] +=
          row.dot(Vector3d(fit.weight[k][0], fit.weight[k][1], fit.weight[k][2]).cwiseAbs());
  }
  for (const Hinge& hinge : surface.hinges) {
    double sum = 0;
    for (const double slope : hinge.slope) sum += std::abs(slope);
    for (std::size_t k = 0; k < hinge.particle.size(); ++k)
      bound.bend[hinge.particle[k]] += stiffness_bound(hinge) * std::abs(hinge.slope[k]) * sum;
  }
  return bound;
}

std::vector<double> triangle_steps(const Mesh& mesh, double strain) {
  VectorXd area = VectorXd::Zero(mesh.mass.size());
  for (const MembraneElement& element : mesh.surface.membrane)
    for (const int i : element.particle) area[i] += element.area;
  std::vector<double> steps;
  steps.reserve(mesh.surface.membrane.size());
  const std::vector<Eigen::Matrix3d> roots = roots_of(mesh.surface);
  for (const MembraneElement& element : mesh.surface.membrane) {
    const auto panel = static_cast<std::size_t>(element.panel);
    const double stiffness =
        stiffness_bound(element, mesh.surface.stretch[panel], roots[panel], strain);
    double density = 0;  // a third of it, kg/m^2
    for (const int i : element.particle) density += mesh.mass[i] / area[i] / 3;
    steps.push_back(2 * std::sqrt(density * element.area / stiffness));
  }
  return steps;
}

}  // namespace weft

#include "core/lab/equilibrium.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <variant>

#include "core/forces/curvature.h"
#include "core/forces/elastic.h"
#include "core/forces/membrane.h"

namespace weft {
namespace {

using Eigen::Matrix3d;
using Sparse = Eigen::SparseMatrix<double>;

class Statics {
 public:
  Statics(const Mesh& mesh, const Eigen::ArrayXi& held, const Vector3d& gravity)
      : mesh_(mesh), gravity_(gravity), place_(held.size()) {
    for (Eigen::Index i = 0; i < held.size(); ++i) place_[i] = held[i] != 0 ? -1 : 3 * free_++;
  }

  int unknowns() const { return 3 * free_; }

  double energy(const Matrix3Xd& x) const {
    return elastic_energy(mesh_, x) - mesh_.mass.dot(x.transpose() * gravity_);
  }

  // Net forces on the free particles.
  VectorXd force(const Matrix3Xd& x) const {
    Matrix3Xd all = gravity_ * mesh_.mass.transpose();
    add_elastic_forces(mesh_, x, Matrix3Xd::Zero(3, x.cols()), all);
    VectorXd out(unknowns());
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      if (place_[i] >= 0) out.segment<3>(place_[i]) = all.col(i);
    return out;
  }

  void move(Matrix3Xd& x, const VectorXd& by) const {
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      if (place_[i] >= 0) x.col(i) += by.segment<3>(place_[i]);
  }

  // Second derivatives of the energy. Lower triangle.
  Sparse stiffness(const Matrix3Xd& x) {
    entries_.clear();
    for (const Family& family : mesh_.families)
      for (const auto& [i, j] : family.connections) add_connection(family, i, j, x);
    for (const Stencil& stencil : mesh_.stencils)
      for (std::size_t a = 0; a < 4; ++a)
        for (std::size_t b = 0; b < 4; ++b)
          add(stencil.particle[a], stencil.particle[b],
              stencil.stiffness * stencil.weight[a] * stencil.weight[b]);
    for (const MembraneElement& element : mesh_.surface.membrane) add_element(element, x);
    for (const CurvatureFit& fit : mesh_.surface.fits) add_fit(fit);
    for (int i = 0; i < unknowns(); ++i) entries_.emplace_back(i, i, 0.0);
    Sparse matrix(unknowns(), unknowns());
    matrix.setFromTriplets(entries_.begin(), entries_.end());
    return matrix;
  }

 private:
  void add(int i, int j, const Matrix3d& block) {
    const int row = place_[i], column = place_[j];
    if (row < 0 || column < 0) return;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        if (row + a >= column + b) entries_.emplace_back(row + a, column + b, block(a, b));
  }

  // alike in every direction
  void add(int i, int j, double along_each) {
    const int row = place_[i], column = place_[j];
    if (column < 0 || row < column) return;
    for (int a = 0; a < 3; ++a) entries_.emplace_back(row + a, column + a, along_each);
  }

  void add_connection(const Family& family, int i, int j, const Matrix3Xd& x) {
    const Vector3d x_ij = x.col(j) - x.col(i);
    const double length = x_ij.norm(), rest = family.rest_length;
    double along = 0, across = 0;  // N/m
    if (family.bend) {
      if (length >= rest || length == 0) return;
      along = family.bend->slope(length);
      across = std::visit([&](const auto& g) { return family.bend->force(g, length); },
                          family.bend->function()) /
               length;
    } else {
      if (length < rest && (!family.pushes || length == 0)) return;
      along = family.stiffness;
      across = family.stiffness * (1 - rest / length);
    }
    const Vector3d n = x_ij / length;
    const Matrix3d block = (along - across) * n * n.transpose() + across * Matrix3d::Identity();
    add(i, i, block);
    add(j, j, block);
    add(i, j, -block);
    add(j, i, -block);
  }

  // sum of c_pq grad e_p grad e_q^T over the strains, and s_p times their second derivatives
  void add_element(const MembraneElement& element, const Matrix3Xd& x) {
    const Threads thread = threads_of(element, x);
    const MembraneStrain e = strain_of(thread);
    const MembraneStiffness& c = mesh_.surface.stretch[static_cast<std::size_t>(element.panel)];
    const MembraneStrain s = stress(c, e, mesh_.surface.pushes);
    const bool warp_slack = !mesh_.surface.pushes && s.warp == 0;
    const bool weft_slack = !mesh_.surface.pushes && s.weft == 0;
    Matrix3d law;
    law << (warp_slack ? 0 : c.warp), c.coupling, 0, c.coupling, (weft_slack ? 0 : c.weft), 0, 0, 0,
        c.shear;
    std::array<Matrix3d, 3> gradient;  // columns: of the strains warp, weft and shear, 1/m
    for (std::size_t a = 0; a < 3; ++a)
      gradient[a] << element.du[a] * thread.warp, element.dv[a] * thread.weft,
          element.du[a] * thread.weft + element.dv[a] * thread.warp;
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < 3; ++b) {
        const double geometric =
            s.warp * element.du[a] * element.du[b] + s.weft * element.dv[a] * element.dv[b] +
            s.shear * (element.du[a] * element.dv[b] + element.dv[a] * element.du[b]);
        const Matrix3d block =
            gradient[a] * law * gradient[b].transpose() + geometric * Matrix3d::Identity();
        add(element.particle[a], element.particle[b], element.area * block);
      }
    }
  }

  void add_fit(const CurvatureFit& fit) {
    const Vector3d stiffness = fit_stiffness(mesh_.surface, fit);
    for (std::size_t a = 0; a < fit.particle.size(); ++a) {
      const Vector3d row = stiffness.cwiseProduct(Eigen::Map<const Vector3d>(fit.weight[a].data()));
      for (std::size_t b = 0; b < fit.particle.size(); ++b)
        add(fit.particle[a], fit.particle[b],
            row.dot(Eigen::Map<const Vector3d>(fit.weight[b].data())));
    }
  }

  const Mesh& mesh_;
  Vector3d gravity_;
  Eigen::ArrayXi place_;  // of each particle among the unknowns; -1: held
  int free_ = 0;
  std::vector<Eigen::Triplet<double>> entries_;
};

}  // namespace

Equilibrium find_equilibrium(const Mesh& mesh, const Eigen::ArrayXi& held, const Vector3d& gravity,
                             const Matrix3Xd& start, double tolerance,
                             const std::stop_token& stop) {
  constexpr int kMost = 500, kTries = 60;
  Statics statics(mesh, held, gravity);
  Equilibrium result{start, 0, 0, true};
  if (statics.unknowns() == 0) return result;

  Eigen::SimplicialLDLT<Sparse> solver;
  VectorXd force = statics.force(result.x);
  double energy = statics.energy(result.x);
  double shift = 0;  // added to the diagonal, N/m: Levenberg's
  const auto largest = [](const VectorXd& f) {
    return f.reshaped(3, f.size() / 3).colwise().norm().maxCoeff();
  };
  for (; result.iterations < kMost && !stop.stop_requested(); ++result.iterations) {
    result.residual = largest(force);
    if (result.residual <= tolerance) return result;

    Sparse matrix = statics.stiffness(result.x);
    const double scale = matrix.diagonal().maxCoeff();
    bool moved = false;
    for (int k = 0; k < kTries && !moved && !stop.stop_requested(); ++k) {
      // a direction downhill: the matrix is shifted until it is positive
      Sparse shifted = matrix;
      for (int i = 0; i < statics.unknowns(); ++i) shifted.coeffRef(i, i) += shift + 1e-14 * scale;
      solver.analyzePattern(shifted);
      solver.factorize(shifted);
      const bool positive =
          solver.info() == Eigen::Success && solver.vectorD().minCoeff() > 1e-16 * scale;
      if (positive) {
        const VectorXd step = solver.solve(force);
        Matrix3Xd x = result.x;
        statics.move(x, step);
        const double lower = statics.energy(x);
        const VectorXd there = statics.force(x);
        // near the minimum energies are equal up to rounding, and forces decide
        moved = lower < energy - 1e-4 * step.dot(force) || largest(there) < 0.5 * result.residual;
        if (moved) {
          result.x = x;
          force = there;
          energy = lower;
          shift = shift < 1e-12 * scale ? 0 : shift / 8;
          break;
        }
      }
      shift = std::max(4 * shift, 1e-10 * scale);
    }
    if (!moved) break;
  }
  result.residual = largest(force);
  result.found = result.residual <= tolerance;
  return result;
}

}  // namespace weft

#include "core/lab/equilibrium.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <variant>

#include "core/forces/elastic.h"

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
    return elastic_energy(mesh_, x) -
           mesh_.mass.dot(x.transpose() * gravity_);
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
              stencil.stiffness * stencil.weight[a] * stencil.weight[b] * Matrix3d::Identity());
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

#include "core/motion/stability.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace weft {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A connection's share of a matrix: `along` its direction, `across` it. N/m
struct Block {
  int i, j;
  Vector3d direction;
  double along, across;
};

// a K + b C over vectors of (D x particles), scaled by 1/sqrt(mass) on both sides. One dimension
// serves the graph Laplacian, three the Jacobian.
template <int D>
class Operator {
 public:
  using Point = Eigen::Matrix<double, D, 1>;
  using Points = Eigen::Matrix<double, D, Eigen::Dynamic>;

  Operator(const Mesh& mesh, const VectorXd& inverse_mass, double damping, double air_rate)
      : mesh_(mesh), scale_(inverse_mass.cwiseSqrt()), damping_(damping), air_rate_(air_rate) {}

  void add(const Block& block) { blocks_.push_back(block); }
  void set_factors(double stiffness, double damping) { a_ = stiffness, b_ = damping; }
  Eigen::Index size() const { return scale_.size() * D; }

  VectorXd operator()(const VectorXd& in) const {
    const Eigen::Map<const Points> given(in.data(), D, scale_.size());
    const Points y = given * scale_.asDiagonal();
    Points out = Points::Zero(D, scale_.size());
    for (const Block& block : blocks_) {
      const Point difference = y.col(block.i) - y.col(block.j);
      Point f = (a_ * block.across + b_ * damping_) * difference;
      if constexpr (D == 3)
        f += a_ * (block.along - block.across) * block.direction.dot(difference) * block.direction;
      out.col(block.i) += f;
      out.col(block.j) -= f;
    }
    for (const Stencil& stencil : mesh_.stencils) {
      Point sum = Point::Zero();
      for (std::size_t k = 0; k < 4; ++k) sum += stencil.weight[k] * y.col(stencil.particle[k]);
      sum *= a_ * stencil.stiffness;
      for (std::size_t k = 0; k < 4; ++k) out.col(stencil.particle[k]) += stencil.weight[k] * sum;
    }
    for (Eigen::Index i = 0; i < scale_.size(); ++i) {
      out.col(i) *= scale_[i];
      if (scale_[i] > 0) out.col(i) += b_ * air_rate_ * given.col(i);
    }
    return Eigen::Map<const VectorXd>(out.data(), out.size());
  }

 private:
  const Mesh& mesh_;
  VectorXd scale_;
  double damping_, air_rate_;
  double a_ = 1, b_ = 0;
  std::vector<Block> blocks_;
};

// Largest eigenvalue by Lanczos' method, from a fixed start, up to where it stops growing.
template <int D>
double largest_eigenvalue(const Operator<D>& matrix) {
  constexpr int kMost = 120, kCheckEvery = 8;
  constexpr double kTolerance = 1e-4;
  const Eigen::Index n = matrix.size();
  VectorXd q(n), before = VectorXd::Zero(n);
  std::uint64_t state = 0x9e3779b97f4a7c15u;
  for (Eigen::Index i = 0; i < n; ++i) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    q[i] = static_cast<double>(state >> 11) * 0x1p-53 - 0.5;
  }
  q.normalize();
  std::vector<double> diagonal, off;
  double largest = 0, beta = 0;
  for (int k = 0; k < std::min<Eigen::Index>(kMost, n); ++k) {
    VectorXd next = matrix(q) - beta * before;
    const double alpha = q.dot(next);
    next -= alpha * q;
    beta = next.norm();
    diagonal.push_back(alpha);
    const bool done = beta <= 1e-12 * std::abs(alpha) || k + 1 == std::min<Eigen::Index>(kMost, n);
    if (done || (k + 1) % kCheckEvery == 0) {
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
      solver.computeFromTridiagonal(
          Eigen::Map<VectorXd>(diagonal.data(), static_cast<Eigen::Index>(diagonal.size())),
          Eigen::Map<VectorXd>(off.data(), static_cast<Eigen::Index>(off.size())),
          Eigen::EigenvaluesOnly);
      const double found = solver.eigenvalues().maxCoeff();
      const double change = std::abs(found - largest);
      largest = found;
      if (done || change <= kTolerance * found) break;
    }
    off.push_back(beta);
    before = q;
    q = next / beta;
  }
  return std::max(0.0, largest);
}

// The dt at which the largest eigenvalue of dt^2 K + 4 dt C reaches 4.
template <int D>
double verlet_step(Operator<D>& matrix, double stiffness, double damping) {
  if (stiffness <= 0 && damping <= 0) return kInfinity;
  // by the largest eigenvalues apart, then refined: on a log scale the root is nearly linear
  double dt = 2 / (damping + std::sqrt(damping * damping + stiffness));
  if (damping == 0) return dt;
  for (int i = 0; i < 6; ++i) {
    matrix.set_factors(dt * dt, 4 * dt);
    const double value = largest_eigenvalue(matrix);
    const double share = 4 * dt * damping / (4 * dt * damping + dt * dt * stiffness);
    const double factor = std::pow(4 / value, 1 / (2 - share));
    dt *= factor;
    if (std::abs(factor - 1) < 1e-4) break;
  }
  return dt;
}

// dt for the integrators that keep velocities. stiffness: omega^2, 1/s^2; damping: gamma, 1/s;
// ratio: lower bound of gamma / omega^2 over all modes, s.
double velocity_step(IntegratorKind kind, double stiffness, double damping, double ratio) {
  const double omega = std::sqrt(stiffness);
  const double radius = damping / 2 + std::sqrt(damping * damping / 4 + stiffness);
  if (radius == 0) return kInfinity;
  switch (kind) {
    case IntegratorKind::kEuler:  // |1 + z| <= 1 for underdamped modes: dt < gamma / omega^2
      return std::min(omega > 0 ? ratio : kInfinity, 1 / radius);
    case IntegratorKind::kMidpoint:  // |z|^4 / 4 of growth against 2 Re z of damping
      return std::min(omega > 0 ? std::cbrt(4 * ratio / stiffness) : kInfinity, 1.5 / radius);
    default:  // the half disc of radius 2.6 lies within the stability region of RK4
      return 2.6 / radius;
  }
}

template <int D>
double limit(IntegratorKind kind, Operator<D>& matrix, double stiffness, double damping,
             double ratio) {
  return kind == IntegratorKind::kVerlet ? verlet_step(matrix, stiffness, damping)
                                         : velocity_step(kind, stiffness, damping, ratio);
}

Block jacobian_block(const Family& family, const Connection& connection, const Matrix3Xd& x) {
  const auto& [i, j] = connection;
  const Vector3d x_ij = x.col(j) - x.col(i);
  const double length = x_ij.norm();
  if (length == 0) return {i, j, Vector3d::Zero(), 0, 0};
  const Vector3d direction = x_ij / length;
  if (family.bend) {
    if (length >= family.rest_length) return {i, j, direction, 0, 0};
    const double force = std::visit([&](const auto& g) { return family.bend->force(g, length); },
                                    family.bend->function());
    return {i, j, direction, family.bend->slope(length), force / length};
  }
  if (length < family.rest_length && !family.pushes) return {i, j, direction, 0, 0};
  return {i, j, direction, family.stiffness, family.stiffness * (1 - family.rest_length / length)};
}

double stiffness_of(const Family& family) {
  return family.bend ? family.bend->largest_slope() : family.stiffness;
}

Operator<1> graph_of(const Mesh& mesh, const VectorXd& inverse_mass, double damping,
                     double air_rate) {
  Operator<1> graph(mesh, inverse_mass, damping, air_rate);
  for (const Family& family : mesh.families)
    for (const auto& [i, j] : family.connections)
      graph.add({i, j, Vector3d::Zero(), stiffness_of(family), stiffness_of(family)});
  return graph;
}

// Of stiffness K + damping C.
template <int D>
double eigenvalue(Operator<D>& matrix, double stiffness, double damping) {
  matrix.set_factors(stiffness, damping);
  return largest_eigenvalue(matrix);
}

}  // namespace

StableStep stable_step(const Mesh& mesh, const VectorXd& inverse_mass, IntegratorKind integrator,
                       double air_rate, const Matrix3Xd& x) {
  Operator<1> graph = graph_of(mesh, inverse_mass, mesh.damping, air_rate);
  Operator<3> jacobian(mesh, inverse_mass, mesh.damping, air_rate);
  double largest_stiffness = 0;
  for (const Family& family : mesh.families) {
    largest_stiffness = std::max(largest_stiffness, stiffness_of(family));
    for (const Connection& connection : family.connections)
      jacobian.add(jacobian_block(family, connection, x));
  }
  // damping acts on the connections only: stencils leave modes without a lower bound
  const double ratio =
      mesh.stencils.empty() && largest_stiffness > 0 ? mesh.damping / largest_stiffness : 0;
  const double omega2 = eigenvalue(graph, 1, 0);
  const double gamma = mesh.damping > 0 || air_rate > 0 ? eigenvalue(graph, 0, 1) : 0;

  StableStep step;
  step.linear_bound = limit(integrator, graph, omega2, gamma, ratio);
  step.estimate = limit(integrator, jacobian, eigenvalue(jacobian, 1, 0), gamma, ratio);
  step.damping_ratio = omega2 > 0 ? gamma / (2 * std::sqrt(omega2)) : 0;
  step.connection_ratio = step.damping_ratio;
  if (omega2 == 0)
    step.connection_ratio = kInfinity;
  else if (air_rate > 0) {
    Operator<1> connections = graph_of(mesh, inverse_mass, mesh.damping, 0);
    step.connection_ratio = eigenvalue(connections, 0, 1) / (2 * std::sqrt(omega2));
  }
  return step;
}

double damping_for(const Mesh& mesh, double ratio) {
  Operator<1> graph = graph_of(mesh, mesh.mass.cwiseInverse(), 1, 0);
  const double omega2 = eigenvalue(graph, 1, 0);
  return omega2 > 0 ? ratio * 2 * std::sqrt(omega2) / eigenvalue(graph, 0, 1) : 0;
}

double safe_share(double connection_ratio) {
  constexpr double kLeast = 0.45, kAtRatio = 1e-4, kMost = 0.9, kSafe = 0.98 * kSafeDampingRatio;
  if (connection_ratio >= kSafe) return 1;
  const double along =
      std::log(std::max(connection_ratio, kAtRatio) / kAtRatio) / std::log(kSafe / kAtRatio);
  return std::lerp(kLeast, kMost, along);
}

}  // namespace weft

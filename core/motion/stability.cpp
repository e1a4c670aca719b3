#include "core/motion/stability.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/forces/curvature.h"
#include "core/forces/elastic.h"
#include "core/forces/hinges.h"
#include "core/forces/membrane.h"
#include "core/motion/integrator.h"
#include "core/motion/surface_bound.h"

namespace weft {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A connection's share of a matrix: `along` its direction, `across` it. N/m
struct Block {
  int i, j;
  Vector3d direction;
  double along, across;
};

double stiffness_of(const Family& family) {
  return family.bend ? family.bend->largest_slope() : family.stiffness;
}

// a K + b C over vectors, scaled by 1/sqrt(mass) on both sides: of the graph Laplacian of the
// largest stiffness of each connection, one value for each particle.
class Graph {
 public:
  Graph(const Mesh& mesh, const VectorXd& inverse_mass, double damping, double air_rate)
      : mesh_(mesh), scale_(inverse_mass.cwiseSqrt()), damping_(damping), air_rate_(air_rate) {
    for (const Family& family : mesh.families) stiffness_.push_back(stiffness_of(family));
  }

  void set_factors(double stiffness, double damping) { a_ = stiffness, b_ = damping; }
  Eigen::Index size() const { return scale_.size(); }

  VectorXd operator()(const VectorXd& in) const {
    const VectorXd y = in.cwiseProduct(scale_);
    VectorXd out = VectorXd::Zero(in.size());
    for (std::size_t k = 0; k < stiffness_.size(); ++k) {
      const double pull = a_ * stiffness_[k] + b_ * damping_;
      for (const auto& [i, j] : mesh_.families[k].connections) {
        const double f = pull * (y[i] - y[j]);
        out[i] += f;
        out[j] -= f;
      }
    }
    for (const Stencil& stencil : mesh_.stencils) {
      double sum = 0;
      for (std::size_t k = 0; k < 4; ++k) sum += stencil.weight[k] * y[stencil.particle[k]];
      sum *= a_ * stencil.stiffness;
      for (std::size_t k = 0; k < 4; ++k) out[stencil.particle[k]] += stencil.weight[k] * sum;
    }
    for (Eigen::Index i = 0; i < in.size(); ++i) {
      out[i] *= scale_[i];
      if (scale_[i] > 0) out[i] += b_ * air_rate_ * in[i];
    }
    return out;
  }

 private:
  const Mesh& mesh_;
  VectorXd scale_;
  double damping_, air_rate_;
  double a_ = 1, b_ = 0;
  std::vector<double> stiffness_;  // of each family, N/m
};

// The same of connections' Jacobian, over (3 x particles).
class Jacobian {
 public:
  Jacobian(const Mesh& mesh, const VectorXd& inverse_mass, double damping, double air_rate)
      : mesh_(mesh), scale_(inverse_mass.cwiseSqrt()), damping_(damping), air_rate_(air_rate) {}

  void add(const Block& block) { blocks_.push_back(block); }
  void set_factors(double stiffness, double damping) { a_ = stiffness, b_ = damping; }
  Eigen::Index size() const { return 3 * scale_.size(); }

  VectorXd operator()(const VectorXd& in) const {
    const Eigen::Map<const Matrix3Xd> given(in.data(), 3, scale_.size());
    const Matrix3Xd y = given * scale_.asDiagonal();
    Matrix3Xd out = Matrix3Xd::Zero(3, scale_.size());
    for (const Block& block : blocks_) {
      const Vector3d difference = y.col(block.i) - y.col(block.j);
      Vector3d f = (a_ * block.across + b_ * damping_) * difference;
      f += a_ * (block.along - block.across) * block.direction.dot(difference) * block.direction;
      out.col(block.i) += f;
      out.col(block.j) -= f;
    }
    for (const Stencil& stencil : mesh_.stencils) {
      Vector3d sum = Vector3d::Zero();
      for (std::size_t k = 0; k < 4; ++k) sum += stencil.weight[k] * y.col(stencil.particle[k]);
      sum *= a_ * stencil.stiffness;
      for (std::size_t k = 0; k < 4; ++k) out.col(stencil.particle[k]) += stencil.weight[k] * sum;
    }
    for (Eigen::Index i = 0; i < scale_.size(); ++i) {
      out.col(i) *= scale_[i];
      if (scale_[i] > 0) out.col(i) += b_ * air_rate_ * given.col(i);
    }
    return out.reshaped();
  }

 private:
  const Mesh& mesh_;
  VectorXd scale_;
  double damping_, air_rate_;
  double a_ = 1, b_ = 0;
  std::vector<Block> blocks_;
};

// The same of triangles at a shape x. In single precision, which bears more digits than are asked
// of its largest eigenvalue.
class SurfaceOperator {
 public:
  // threads_at: those of an element.
  template <class F>
  SurfaceOperator(const Mesh& mesh, const VectorXd& inverse_mass, double air_rate,
                  const F& threads_at)
      : mesh_(mesh), scale_(inverse_mass.cwiseSqrt().cast<float>()), air_rate_(air_rate) {
    const Surface& surface = mesh.surface;
    tangents_.reserve(surface.membrane.size());
    for (const MembraneElement& element : surface.membrane)
      tangents_.push_back(tangent_of(surface, element, threads_at(element)));
    for (const CurvatureFit& fit : surface.fits) {
      const Vector3d root = fit_stiffness(surface, fit).cwiseSqrt();
      fits_.push_back(static_cast<int>(fit.particle.size()));
      for (std::size_t k = 0; k < fit.particle.size(); ++k)
        weights_.push_back({fit.particle[k],
                            Vector3d::Map(fit.weight[k].data()).cwiseProduct(root).cast<float>()});
    }
    for (const Hinge& hinge : surface.hinges) {
      const double root = std::sqrt(stiffness_bound(hinge));
      fits_.push_back(static_cast<int>(hinge.particle.size()));
      for (std::size_t k = 0; k < hinge.particle.size(); ++k)
        weights_.push_back({hinge.particle[k], {static_cast<float>(root * hinge.slope[k]), 0, 0}});
    }
  }

  // Precondition: stiffness > 0.
  void set_factors(double stiffness, double damping) { a_ = stiffness, b_ = damping; }
  Eigen::Index size() const { return 3 * scale_.size(); }

  VectorXd operator()(const VectorXd& in) const {
    const Eigen::Map<const Matrix3Xd> given(in.data(), 3, scale_.size());
    Points y = Points::Zero(4, scale_.size()), pull = y;  // pull: over a
    y.topRows<3>() = given.cast<float>() * scale_.asDiagonal();
    for (const Tangent& tangent : tangents_) add(tangent, y, pull);
    const Weight* weight = weights_.data();
    for (const int count : fits_) add(std::exchange(weight, weight + count), count, y, pull);
    const auto damping = static_cast<float>(b_ * mesh_.damping / a_);
    for (const Family& family : mesh_.families) {
      if (damping == 0) break;
      for (const auto& [i, j] : family.connections) {
        const Point pulled = damping * (y.col(i) - y.col(j));
        pull.col(i) += pulled;
        pull.col(j) -= pulled;
      }
    }
    Matrix3Xd out = a_ * (pull.topRows<3>().cast<double>() * scale_.cast<double>().asDiagonal());
    for (Eigen::Index i = 0; i < scale_.size(); ++i)
      if (scale_[i] > 0) out.col(i) += b_ * air_rate_ * given.col(i);
    return out.reshaped();
  }

 private:
  using Point = Eigen::Vector4f;  // x, y, z and 0
  using Points = Eigen::Matrix4Xf;
  // Second derivatives of a triangle's energy: of its strains, and of its threads under stress.
  struct Tangent {
    Point warp, weft;  // threads
    std::array<int, 3> particle;
    std::array<float, 3> du, dv;               // 1/m
    float along_warp, along_weft;              // stiffness times area, N m
    float coupling, shear;                     // N m
    float warp_stress, weft_stress, shearing;  // times area, N m
  };
  // What a fit weighs a particle by, times the root of its stiffness.
  struct Weight {
    int particle;
    Eigen::Vector3f uu_uv_vv;
  };

  static Point point(const Vector3d& v) {
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()), 0};
  }

  static Tangent tangent_of(const Surface& surface, const MembraneElement& element,
                            const Threads& threads) {
    MembraneStiffness stiffness = surface.stretch[static_cast<std::size_t>(element.panel)];
    const MembraneStrain strain = strain_of(threads);
    const MembraneStrain under = stress(stiffness, strain, surface.pushes);
    if (!surface.pushes && strain.warp < 0) stiffness.warp = 0;
    if (!surface.pushes && strain.weft < 0) stiffness.weft = 0;
    const auto times_area = [&](double value) { return static_cast<float>(element.area * value); };
    Tangent tangent{point(threads.warp),
                    point(threads.weft),
                    element.particle,
                    {},
                    {},
                    times_area(stiffness.warp),
                    times_area(stiffness.weft),
                    times_area(stiffness.coupling),
                    times_area(stiffness.shear),
                    times_area(under.warp),
                    times_area(under.weft),
                    times_area(under.shear)};
    for (std::size_t k = 0; k < 3; ++k) {
      tangent.du[k] = static_cast<float>(element.du[k]);
      tangent.dv[k] = static_cast<float>(element.dv[k]);
    }
    return tangent;
  }

  static void add(const Tangent& tangent, const Points& y, Points& out) {
    Point warp = Point::Zero(), weft = warp;  // how threads move
    for (std::size_t k = 0; k < 3; ++k) {
      const Point at = y.col(tangent.particle[k]);
      warp += tangent.du[k] * at;
      weft += tangent.dv[k] * at;
    }
    const float along_warp = tangent.warp.dot(warp), along_weft = tangent.weft.dot(weft);
    const float sheared = tangent.shear * (tangent.warp.dot(weft) + tangent.weft.dot(warp));
    const Point pull_warp =
        (tangent.along_warp * along_warp + tangent.coupling * along_weft) * tangent.warp +
        sheared * tangent.weft + tangent.warp_stress * warp + tangent.shearing * weft;
    const Point pull_weft =
        (tangent.along_weft * along_weft + tangent.coupling * along_warp) * tangent.weft +
        sheared * tangent.warp + tangent.weft_stress * weft + tangent.shearing * warp;
    for (std::size_t k = 0; k < 3; ++k)
      out.col(tangent.particle[k]) += tangent.du[k] * pull_warp + tangent.dv[k] * pull_weft;
  }

  static void add(const Weight* weights, int count, const Points& y, Points& out) {
    Point uu = Point::Zero(), uv = uu, vv = uu;
    for (int k = 0; k < count; ++k) {
      const auto& [particle, weight] = weights[k];
      const Point at = y.col(particle);
      uu += weight[0] * at;
      uv += weight[1] * at;
      vv += weight[2] * at;
    }
    for (int k = 0; k < count; ++k) {
      const auto& [particle, weight] = weights[k];
      out.col(particle) += weight[0] * uu + weight[1] * uv + weight[2] * vv;
    }
  }

  const Mesh& mesh_;
  Eigen::VectorXf scale_;
  double air_rate_;
  double a_ = 1, b_ = 0;
  std::vector<Tangent> tangents_;
  std::vector<int> fits_;  // particles of each, and of hinges
  std::vector<Weight> weights_;
};

// Largest eigenvalue by Lanczos' method, from a fixed start, up to where it stops growing.
template <class Matrix>
double largest_eigenvalue(const Matrix& matrix) {
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
    before.swap(q);
    q = next / beta;
  }
  return std::max(0.0, largest);
}

// How many dt C count in Verlet's limit, dt^2 K + weight dt C = 4.
double damping_weight(IntegratorKind kind) { return 2 * (lead_of(kind) - 1); }

// dt by the largest eigenvalues of K and C, or bounds of them.
double verlet_step(IntegratorKind kind, double stiffness, double damping) {
  if (stiffness <= 0 && damping <= 0) return kInfinity;
  damping *= damping_weight(kind) / 4;
  return 2 / (damping + std::sqrt(damping * damping + stiffness));
}

// The dt at which the largest eigenvalue of both together reaches 4, from those apart. What is left
// of a last change is of its second order.
template <class Matrix>
double verlet_step(IntegratorKind kind, Matrix& matrix, double stiffness, double damping,
                   double last_change) {
  double dt = verlet_step(kind, stiffness, damping);
  if (dt == kInfinity || damping == 0) return dt;
  const double weight = damping_weight(kind);
  // on a log scale the root is nearly linear
  for (int i = 0; i < 6; ++i) {
    matrix.set_factors(dt * dt, weight * dt);
    const double value = largest_eigenvalue(matrix);
    const double share = weight * dt * damping / (weight * dt * damping + dt * dt * stiffness);
    const double factor = std::pow(4 / value, 1 / (2 - share));
    dt *= factor;
    if (std::abs(factor - 1) < last_change) break;
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

template <class Matrix>
double limit(IntegratorKind kind, Matrix& matrix, double stiffness, double damping, double ratio) {
  return is_verlet(kind) ? verlet_step(kind, matrix, stiffness, damping, 1e-4)
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

// Of stiffness K + damping C.
template <class Matrix>
double eigenvalue(Matrix& matrix, double stiffness, double damping) {
  matrix.set_factors(stiffness, damping);
  return largest_eigenvalue(matrix);
}

double limit(IntegratorKind kind, double stiffness, double damping) {
  return is_verlet(kind) ? verlet_step(kind, stiffness, damping)
                         : velocity_step(kind, stiffness, damping, 0);
}

// What resists and damps each free particle of triangles at most, over its mass, 1/s^2 and 1/s.
struct Rates {
  VectorXd stiffness, damping;

  int stiffest() const {
    Eigen::Index i = 0;
    stiffness.maxCoeff(&i);
    return static_cast<int>(i);
  }
  // Of the stiffest; infinity where nothing is stiff.
  double damping_ratio() const {
    const int i = stiffest();
    return stiffness[i] > 0 ? damping[i] / (2 * std::sqrt(stiffness[i])) : kInfinity;
  }
};
Rates largest_rates(const Mesh& mesh, const VectorXd& inverse_mass, double damping,
                    const SurfaceBound& bound) {
  VectorXd damped = VectorXd::Zero(mesh.mass.size());
  for (const Family& family : mesh.families)
    for (const auto& [i, j] : family.connections) {
      damped[i] += 2 * damping;
      damped[j] += 2 * damping;
    }
  return {(bound.membrane + bound.bend).cwiseProduct(inverse_mass),
          damped.cwiseProduct(inverse_mass)};
}

// The linear bound of triangles: that of the particle that bears least.
struct SurfaceStep {
  double bound = kInfinity;  // s
  double damping = 0;        // of the particle that is damped most, 1/s
  int limiting_particle = -1;
};
SurfaceStep bounded_step(const Mesh& mesh, const VectorXd& inverse_mass, IntegratorKind integrator,
                         double air_rate, const SurfaceBound& bound) {
  const Rates rates = largest_rates(mesh, inverse_mass, mesh.damping, bound);
  SurfaceStep step;
  for (Eigen::Index i = 0; i < inverse_mass.size(); ++i) {
    if (inverse_mass[i] == 0) continue;
    const double damping = rates.damping[i] + air_rate;
    const double most = limit(integrator, rates.stiffness[i], damping);
    step.damping = std::max(step.damping, damping);
    if (most >= step.bound) continue;
    step.bound = most;
    step.limiting_particle = static_cast<int>(i);
  }
  return step;
}

// The step of Verlet, or of another integrator; gamma: a bound of what damps, 1/s.
double limit(IntegratorKind kind, SurfaceOperator& matrix, double gamma) {
  const double stiffness = eigenvalue(matrix, 1, 0);
  const double apart = limit(kind, stiffness, gamma);
  // only where damping counts do both have to be seen together
  constexpr double kCounts = 0.005, kLastChange = 0.02;
  if (!is_verlet(kind) || apart * gamma <= kCounts) return apart;
  return verlet_step(kind, matrix, stiffness, gamma, kLastChange);
}

// The bound holds up to a strain of kBoundStrain, or up to that of the shape; the estimate takes
// the Jacobian at x.
StableStep surface_step(const Mesh& mesh, const VectorXd& inverse_mass, IntegratorKind integrator,
                        double air_rate, const Matrix3Xd& x) {
  const double strain = std::max(kBoundStrain, largest_strain(mesh, x));
  const auto [bound, gamma, limiting] =
      bounded_step(mesh, inverse_mass, integrator, air_rate, surface_bound(mesh, strain));
  StableStep step;
  step.linear_bound = bound;
  step.limiting_particle = limiting;

  SurfaceOperator jacobian(mesh, inverse_mass, air_rate,
                           [&](const MembraneElement& element) { return threads_of(element, x); });
  step.estimate = limit(integrator, jacobian, gamma);
  const Rates unstrained =
      largest_rates(mesh, inverse_mass, mesh.damping, surface_bound(mesh, 0.0));
  step.connection_ratio = unstrained.damping_ratio();
  step.damping_ratio = std::isinf(step.connection_ratio) ? 0 : step.connection_ratio;
  return step;
}

}  // namespace

double linear_bound(const Mesh& mesh, const VectorXd& inverse_mass, IntegratorKind integrator,
                    double air_rate, const Matrix3Xd& x) {
  const VectorXd strains = largest_strains(mesh.surface, x).cwiseMax(kBoundStrain);
  return bounded_step(mesh, inverse_mass, integrator, air_rate, surface_bound(mesh, strains)).bound;
}

StableStep stable_step(const Mesh& mesh, const VectorXd& inverse_mass, IntegratorKind integrator,
                       double air_rate, const Matrix3Xd& x) {
  if (!mesh.surface.membrane.empty() || !mesh.surface.fits.empty())
    return surface_step(mesh, inverse_mass, integrator, air_rate, x);
  Graph graph(mesh, inverse_mass, mesh.damping, air_rate);
  Jacobian jacobian(mesh, inverse_mass, mesh.damping, air_rate);
  double largest_stiffness = 0;
  for (const Family& family : mesh.families) {
    largest_stiffness = std::max(largest_stiffness, stiffness_of(family));
    if (x.size() == 0) continue;
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
  step.estimate = x.size() == 0
                      ? kInfinity
                      : limit(integrator, jacobian, eigenvalue(jacobian, 1, 0), gamma, ratio);
  step.damping_ratio = omega2 > 0 ? gamma / (2 * std::sqrt(omega2)) : 0;
  step.connection_ratio = step.damping_ratio;
  if (omega2 == 0)
    step.connection_ratio = kInfinity;
  else if (air_rate > 0) {
    Graph connections(mesh, inverse_mass, mesh.damping, 0);
    step.connection_ratio = eigenvalue(connections, 0, 1) / (2 * std::sqrt(omega2));
  }
  return step;
}

double unsheared_gain(const Mesh& mesh, const VectorXd& inverse_mass, IntegratorKind integrator,
                      double air_rate, const Matrix3Xd& flat) {
  if (!mesh.surface.membrane.empty() || !mesh.surface.fits.empty()) {
    const SurfaceStep any =
        bounded_step(mesh, inverse_mass, integrator, air_rate, surface_bound(mesh, 0.0));
    SurfaceOperator at_rest(mesh, inverse_mass, air_rate, [](const MembraneElement&) {
      return Threads{Vector3d::UnitX(), Vector3d::UnitY()};
    });
    return std::max(1.0, limit(integrator, at_rest, any.damping) / any.bound);
  }
  Graph graph(mesh, inverse_mass, mesh.damping, air_rate);
  Jacobian taut(mesh, inverse_mass, mesh.damping, air_rate);
  for (const Family& family : mesh.families)
    for (const auto& [i, j] : family.connections)
      taut.add({i, j, (flat.col(j) - flat.col(i)).normalized(), stiffness_of(family), 0});
  const double gamma = mesh.damping > 0 || air_rate > 0 ? eigenvalue(graph, 0, 1) : 0;
  const double any = verlet_step(integrator, graph, eigenvalue(graph, 1, 0), gamma, 1e-4);
  const double unsheared = verlet_step(integrator, taut, eigenvalue(taut, 1, 0), gamma, 1e-4);
  return any < kInfinity ? std::max(1.0, unsheared / any) : 1;
}

double damping_for(const Mesh& mesh, double ratio) {
  if (!mesh.surface.membrane.empty()) {
    const double unit =
        largest_rates(mesh, mesh.mass.cwiseInverse(), 1, surface_bound(mesh, 0.0)).damping_ratio();
    return unit > 0 && unit < kInfinity ? ratio / unit : 0;
  }
  Graph graph(mesh, mesh.mass.cwiseInverse(), 1, 0);
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

double borne_share(const SolverSettings& solver, const StableStep& stable) {
  if (!is_verlet(solver.integrator)) return solver.safety;
  return std::min(solver.safety, safe_share(stable.connection_ratio));
}

double unsheared_share(const Mesh& mesh, double connection_ratio) {
  constexpr double kNone = 2e-3, kAll = 1e-2, kSwitching = 0.75;
  const bool switches = mesh.surface.membrane.empty() || !mesh.surface.pushes;
  const double damped = std::log(connection_ratio / kNone) / std::log(kAll / kNone);
  return (switches ? kSwitching : 1) * std::clamp(damped, 0.0, 1.0);
}

}  // namespace weft

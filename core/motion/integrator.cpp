#include "core/motion/integrator.h"

namespace weft {

std::unique_ptr<Integrator> make_integrator(IntegratorKind kind) {
  switch (kind) {
    case IntegratorKind::kEuler:
      return make_euler();
    case IntegratorKind::kMidpoint:
      return make_midpoint();
    case IntegratorKind::kRk4:
      return make_rk4();
    case IntegratorKind::kVerlet:
    case IntegratorKind::kLaggedVerlet:
      break;
  }
  return make_verlet(lead_of(kind));
}

void sum_forces(const Dynamics& dynamics, double time, int slow, double give, const Matrix3Xd& x,
                const Matrix3Xd& v, Matrix3Xd& force) {
  dynamics.force(time, x, v, force);
  if (slow == 0 || !dynamics.slow_force) return;
  if (slow == 1) return dynamics.slow_force(time, give, x, v, force);
  Matrix3Xd once = Matrix3Xd::Zero(3, x.cols());
  dynamics.slow_force(time, give, x, v, once);
  force += slow * once;
}

void accelerate(const Dynamics& dynamics, double time, const Matrix3Xd& x, const Matrix3Xd& v,
                Matrix3Xd& a) {
  const bool each = dynamics.slow_every == 1;
  sum_forces(dynamics, time, each ? 1 : 0, 0, x, v, a);
  if (each && dynamics.drag.size() > 0) {
    const Vector3d air = dynamics.air(time);
    for (Eigen::Index i = 0; i < a.cols(); ++i) a.col(i) += dynamics.drag[i] * (air - v.col(i));
  }
  for (Eigen::Index i = 0; i < a.cols(); ++i) {
    const double inverse_mass = dynamics.inverse_mass[i];
    a.col(i) = inverse_mass == 0 ? Vector3d(Vector3d::Zero())
                                 : Vector3d(inverse_mass * a.col(i) + dynamics.gravity);
  }
}

}  // namespace weft

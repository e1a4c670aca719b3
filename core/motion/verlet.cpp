#include "core/motion/integrator.h"

namespace weft {
namespace {

// Velocity-less Verlet (eq. 8) in summed form: d' = d + a dt^2, x' = x + d'. Second order with
// damping where forces see the velocity extrapolated to the present, see lead_of(), first order
// where they see d / dt; drag is centred, -c (d' + d) / (2 dt).
class Verlet : public Integrator {
 public:
  explicit Verlet(double lead) : lead_(lead) {}

  void start(const Dynamics& dynamics, double time, double dt, const Matrix3Xd& v,
             Motion& motion) override {
    // half a kick: x(-dt) = x - v dt + a dt^2 / 2
    accelerate(dynamics, time, motion.x, v, a_);
    motion.d = v * dt - a_ * (dt * dt / 2);
    motion.d_previous = motion.d;
    if (lead_ != 2) motion.d_previous = (lead_ * motion.d - v * (2 * dt)) / (lead_ - 2);
  }

  void advance(const Dynamics& dynamics, double time, double dt, int slow,
               Motion& motion) override {
    velocity(motion, dt, v_);
    sum_forces(dynamics, time, slow, give_of(dynamics, slow, dt), motion.x, v_, a_);
    motion.d_previous.swap(motion.d);
    const bool drag = slow > 0 && dynamics.drag.size() > 0;
    const Vector3d air = drag ? dynamics.air(time) : Vector3d(Vector3d::Zero());
    for (Eigen::Index i = 0; i < a_.cols(); ++i) {
      const double inverse_mass = dynamics.inverse_mass[i];
      if (inverse_mass == 0) {
        motion.d.col(i) = motion.d_previous.col(i);
        continue;
      }
      Vector3d a = inverse_mass * a_.col(i) + dynamics.gravity;
      if (drag) {
        const double rate = slow * dynamics.drag[i] * inverse_mass;  // 1/s
        a += rate * air;
        motion.d.col(i) =
            ((1 - rate * dt / 2) * motion.d_previous.col(i) + a * (dt * dt)) / (1 + rate * dt / 2);
      } else {
        motion.d.col(i) = motion.d_previous.col(i) + a * (dt * dt);
      }
    }
    motion.x += motion.d;
  }

  // v = d / dt + a dt / 2: d stands for the velocity half a step ago
  void closing_velocity(const Dynamics& dynamics, double time, double dt, const Motion& motion,
                        Matrix3Xd& v) override {
    velocity(motion, dt, v_);
    accelerate(dynamics, time, motion.x, v_, a_);
    v = motion.d / dt + a_ * (dt / 2);
  }

  void velocity(const Motion& motion, double dt, Matrix3Xd& v) const override {
    v = (lead_ * motion.d - (lead_ - 2) * motion.d_previous) / (2 * dt);
  }

 private:
  double lead_;
  Matrix3Xd v_, a_;
};

}  // namespace

std::unique_ptr<Integrator> make_verlet(double lead) { return std::make_unique<Verlet>(lead); }

}  // namespace weft

#include "core/motion/runge_kutta.h"

namespace weft {
namespace {

// Forward Euler, as Table II counts it: x' = x + v dt, v' = v + a(x, v) dt.
class Euler : public VelocityIntegrator {
 public:
  void advance(const Dynamics& dynamics, double time, double dt, int /*slow*/,
               Motion& motion) override {
    velocity(motion, dt, v_);
    accelerate(dynamics, time, motion.x, v_, a_);
    motion.d_previous = motion.d;
    motion.x += motion.d;
    motion.d += a_ * (dt * dt);
  }

 private:
  Matrix3Xd v_, a_;
};

}  // namespace

std::unique_ptr<Integrator> make_euler() { return std::make_unique<Euler>(); }

}  // namespace weft

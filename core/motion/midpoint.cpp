#include "core/motion/runge_kutta.h"

namespace weft {
namespace {

// Midpoint: the slopes half a step ahead carry over the whole step.
class Midpoint : public VelocityIntegrator {
 public:
  void advance(const Dynamics& dynamics, double time, double dt, int /*slow*/,
               Motion& motion) override {
    velocity(motion, dt, v_);
    accelerate(dynamics, time, motion.x, v_, a_);
    x_middle_ = motion.x + v_ * (dt / 2);
    v_ += a_ * (dt / 2);
    accelerate(dynamics, time + dt / 2, x_middle_, v_, a_);
    motion.d_previous = motion.d;
    motion.x += v_ * dt;
    motion.d += a_ * (dt * dt);
  }

 private:
  Matrix3Xd v_, a_, x_middle_;
};

}  // namespace

std::unique_ptr<Integrator> make_midpoint() { return std::make_unique<Midpoint>(); }

}  // namespace weft

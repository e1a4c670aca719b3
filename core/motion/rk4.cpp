#include "core/motion/runge_kutta.h"

namespace weft {
namespace {

// Runge and Kutta's classical method: slopes at the start, twice in the middle, at the end,
// 1:2:2:1.
class Rk4 : public VelocityIntegrator {
 public:
  void advance(const Dynamics& dynamics, double time, double dt, int /*slow*/,
               Motion& motion) override {
    velocity(motion, dt, v_);
    accelerate(dynamics, time, motion.x, v_, a_);
    v_sum_ = v_;
    a_sum_ = a_;
    const auto stage = [&](double ahead, double weight) {
      x_stage_ = motion.x + v_stage_ * ahead;
      v_stage_ = v_ + a_ * ahead;
      accelerate(dynamics, time + ahead, x_stage_, v_stage_, a_);
      v_sum_ += weight * v_stage_;
      a_sum_ += weight * a_;
    };
    v_stage_ = v_;
    stage(dt / 2, 2);
    stage(dt / 2, 2);
    stage(dt, 1);
    motion.d_previous = motion.d;
    motion.x += v_sum_ * (dt / 6);
    motion.d += a_sum_ * (dt * dt / 6);
  }

 private:
  Matrix3Xd v_, a_, v_sum_, a_sum_, x_stage_, v_stage_;
};

}  // namespace

std::unique_ptr<Integrator> make_rk4() { return std::make_unique<Rk4>(); }

}  // namespace weft

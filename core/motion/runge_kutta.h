#pragma once

#include "core/motion/integrator.h"

namespace weft {

// What the integrators that keep velocities share: d holds v dt.
class VelocityIntegrator : public Integrator {
 public:
  void start(const Dynamics&, double, double dt, const Matrix3Xd& v, Motion& motion) override {
    motion.d = v * dt;
    motion.d_previous = motion.d;
  }
  void closing_velocity(const Dynamics&, double, double dt, const Motion& motion,
                        Matrix3Xd& v) override {
    velocity(motion, dt, v);
  }
  void velocity(const Motion& motion, double dt, Matrix3Xd& v) const override { v = motion.d / dt; }
};

}  // namespace weft

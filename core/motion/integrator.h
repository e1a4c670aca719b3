#pragma once

#include <functional>
#include <memory>

#include "core/model/mesh.h"
#include "core/motion/tethers.h"

namespace weft {

// Motion of one sheet, (3 x particles) each.
struct Motion {
  Matrix3Xd x;           // position, m
  Matrix3Xd d;           // displacement of the last step, m; velocity x step where not Verlet
  Matrix3Xd d_previous;  // displacement of the step before it, m
};

// What moves a sheet.
struct Dynamics {
  // Writes all forces but slow ones, drag and weight, N, given time, positions and velocities.
  std::function<void(double, const Matrix3Xd&, const Matrix3Xd&, Matrix3Xd&)> force;
  // Adds those that change slowly, N, given time, give (see give_of()), positions and velocities;
  // none: there are none.
  std::function<void(double, double, const Matrix3Xd&, const Matrix3Xd&, Matrix3Xd&)> slow_force;
  // They and drag act in one of so many steps, so many times as strongly (r-RESPA, Tuckerman et al.
  // 1992): amid these, so that velocities before and after them are complete.
  int slow_every = 1;
  double density = 0;     // of the sheet as a whole, kg/m^2, where wind blows
  VectorXd inverse_mass;  // 1/kg, 0: held; such a particle keeps its d
  VectorXd drag;          // kg/s, or empty
  Vector3d gravity;       // m/s^2
  // Velocity of the air that drags, m/s.
  std::function<Vector3d(double)> air;
  Tethers tethers;  // empty: none
};

// Steps a sheet in time. dt in s.
class Integrator {
 public:
  virtual ~Integrator() = default;
  // Sets d and d_previous from x at `time` and velocities v.
  virtual void start(const Dynamics& dynamics, double time, double dt, const Matrix3Xd& v,
                     Motion& motion) = 0;
  // Advances x, d and d_previous from `time` by dt. slow: how many times as strongly slow forces
  // and drag act, 1 but for Verlet.
  virtual void advance(const Dynamics& dynamics, double time, double dt, int slow,
                       Motion& motion) = 0;
  // Velocities at `time` as the forces there complete them, m/s: what start() needs to go on with
  // other forces or another dt without losing an order.
  virtual void closing_velocity(const Dynamics& dynamics, double time, double dt,
                                const Motion& motion, Matrix3Xd& v) = 0;
  // Velocities of the present state without asking for forces, m/s.
  virtual void velocity(const Motion& motion, double dt, Matrix3Xd& v) const = 0;
};

// Verlet's forces see the velocity (lead d - (lead - 2) d_previous) / (2 dt): extrapolated to the
// present, or of half a step ago.
constexpr double lead_of(IntegratorKind kind) {
  return kind == IntegratorKind::kLaggedVerlet ? 2 : 3;
}

std::unique_ptr<Integrator> make_verlet(double lead);
std::unique_ptr<Integrator> make_euler();
std::unique_ptr<Integrator> make_midpoint();
std::unique_ptr<Integrator> make_rk4();
std::unique_ptr<Integrator> make_integrator(IntegratorKind kind);

// The speed that a pressure gives the sheet before Verlet's velocities tell of it where slow forces
// act so many times as strongly, m/s per Pa: from the first of the steps amid which they act. Where
// they act in each, velocities are extrapolated.
inline double give_of(const Dynamics& dynamics, int slow, double dt) {
  return slow > 1 ? slow * dt / 2 / dynamics.density : 0;
}

// Writes forces but drag and weight, slow ones so many times as strong, N.
void sum_forces(const Dynamics& dynamics, double time, int slow, double give, const Matrix3Xd& x,
                const Matrix3Xd& v, Matrix3Xd& force);
// Acceleration with every force that acts in each step, m/s^2; 0 for held particles.
void accelerate(const Dynamics& dynamics, double time, const Matrix3Xd& x, const Matrix3Xd& v,
                Matrix3Xd& a);

}  // namespace weft

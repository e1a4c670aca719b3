#pragma once

#include <memory>
#include <string>

#include "core/contact/contact.h"
#include "core/model/mesh.h"
#include "core/motion/integrator.h"
#include "core/motion/thread_pool.h"

namespace weft {

// Moves one sheet, in storage of its own. Steps are of one length from start() on.
class SheetSolver {
 public:
  virtual ~SheetSolver() = default;

  // Begins, or begins again, from positions (m) and velocities (m/s) at `time`, with steps of dt
  // (s). (3 x particles)
  virtual void start(const Matrix3Xd& x, const Matrix3Xd& v, double time, double dt) = 0;
  // One step of all free particles from `time`; large sheets are shared among the pool.
  virtual void advance(double time, ThreadPool& pool) = 0;
  // Puts a held particle where its path leads it: position and displacement of the step, m.
  virtual void move_held(int particle, const Vector3d& x, const Vector3d& d) = 0;
  // Moves free particles out of colliders.
  virtual void resolve(const Contacts& contacts, ThreadPool& pool) = 0;

  // More than these have nothing to do in a pool.
  virtual int most_threads() const { return 1; }
  // Lets go of memory that only steps need, or that follows from mesh and dynamics. Until that is
  // restored no step is taken, and no state asked for.
  virtual void release_memory() {}
  virtual void restore_memory() {}

  // Present state: m, m/s.
  virtual void positions(Matrix3Xd& x) const = 0;
  virtual void velocities(Matrix3Xd& v) const = 0;
  // Velocities as the forces at `time` complete them, m/s: what start() needs to go on with other
  // forces or another dt without losing an order.
  virtual void closing_velocities(double time, Matrix3Xd& v) const = 0;

  // Everything that later steps depend on, as bytes of this machine, and back: called after
  // start(), with the time and dt that it was saved at. False for bytes that such a solver has not
  // saved.
  virtual std::string save() const = 0;
  [[nodiscard]] virtual bool load(const std::string& saved) = 0;
};

// One connection after the other, in double; any integrator, any force.
std::unique_ptr<SheetSolver> make_plain_solver(const Dynamics& dynamics, IntegratorKind integrator);

}  // namespace weft

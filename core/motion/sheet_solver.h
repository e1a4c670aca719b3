#pragma once

#include <memory>
#include <span>
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
  // One step of all free particles from `time`, in which slow forces and drag act so many times as
  // strongly; large sheets are shared among the pool.
  virtual void advance(double time, int slow, ThreadPool& pool) = 0;
  // Puts a held particle where its path leads it: position and displacement of the step, m.
  virtual void move_held(int particle, const Vector3d& x, const Vector3d& d) = 0;
  // Moves free particles back to where their tethers reach.
  virtual void pull_back(ThreadPool& pool) = 0;
  // Moves free particles out of colliders.
  virtual void resolve(const Contacts& contacts, ThreadPool& pool) = 0;

  // From the next step on says how far particles come, and by how much that changes.
  virtual void measure() = 0;
  // The largest displacement of the last step, and the farthest that resolve() has moved a particle
  // since, at most, m.
  virtual double moved() const = 0;
  virtual double pushed() const = 0;
  // By how much a particle's displacement in a step, and what moved it beside that, differ from its
  // displacement when this was last asked, at most, m; infinite where that is not known.
  virtual double take_change() = 0;
  // Of some particles: positions and displacements of the last step, m. (3 x particles)
  virtual void read(std::span<const int> particles, Eigen::Ref<Matrix3Xd> x,
                    Eigen::Ref<Matrix3Xd> d) const = 0;
  // Moves some free particles: adds to positions and to displacements of the step, m.
  virtual void displace(std::span<const int> particles, const Eigen::Ref<const Matrix3Xd>& by,
                        const Eigen::Ref<const Matrix3Xd>& in_step) = 0;

  // Once the rest shape and stiffness of its mesh have changed: a solver to start, the same as one
  // made of mesh and dynamics, which takes over how this one has laid them out; this one must not
  // be used any more. Null: it has to be made.
  virtual std::unique_ptr<SheetSolver> renewed() { return nullptr; }
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

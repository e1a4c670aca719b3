#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/motion/energy_budget.h"
#include "core/motion/guard.h"
#include "core/sheet_factory.h"

namespace weft {

// A sheet in motion: its mesh, what moves it, and its state at the end of the last frame.
struct MovingSheet {
  explicit MovingSheet(const SheetDefinition& definition) : start(definition) {}

  StartPositions start;  // that paths are relative to
  Mesh mesh;
  Dynamics dynamics;  // the forces in double
  std::unique_ptr<SheetSolver> solver;
  double skin = 0;  // m
  double most_strain = kMostStrain;
  DressingState dressing;
  EnergyBudget budget;
  std::optional<TextileRamp> ramp;
  std::optional<double> damping_in_motion;  // while it relaxes with less, kg/s

  // Mesh, forces and skin of a definition: its textile as it is simulated, and its pins.
  void set_definition(const Scene& scene, const SheetDefinition& definition);
  // The same anew, with the damping that it has: that costs more to find than all else.
  void remake_mesh(const Scene& scene, const SheetDefinition& definition);
  // Mesh and forces as they are while the sheet is put on; what stays is not made anew.
  void dress(const Scene& scene, const SheetDefinition& definition, const DressingState& state);
  // Lets go of what follows from the definition, but for its damping, until it is restored by the
  // same.
  void release_memory();
  void restore_memory(const Scene& scene, const SheetDefinition& definition);
  // What holds its particles.
  void set_pins(const SheetDefinition& definition);
  // What the mesh or the scene lacks is not there to be computed. Holds on to both.
  void bind_forces(const Scene& scene);

  // At the end of the last frame. Between frames it is what the solver holds.
  const SheetState& good() const {
    if (good_.x.size() == 0) read(good_);
    return good_;
  }
  void read_good() { read(good_); }
  void set_good(SheetState& state) { std::swap(good_, state); }

  void read(SheetState& state) const {
    solver->positions(state.x);
    solver->velocities(state.v);
    state.kinetic_energy = kinetic_energy(mesh, state.v);
  }

 private:
  // These take what `dressing` says into account.
  void set_mesh(const Scene& scene, const SheetDefinition& definition, Mesh made);
  void set_air_and_weight(const Scene& scene);

  Surface flat_;             // of the mesh, until its rest shape is the flat one; or empty
  mutable SheetState good_;  // empty: not looked at since
};

// From which a sheet may fall within itself, m.
double height_of(const SheetDefinition& sheet);

// When the last path and the dressing end, s.
double end_of_motion(const Scene& scene);

// Held particles follow the paths of their pins in the step of dt that ends at `time`.
void move_pins(const std::vector<Pin>& pins, double time, double dt, MovingSheet& sheet);
// Particles of holds that last until `time` or longer go back to the height they started at, and do
// not move up or down.
void hold_heights(const Scene& scene, double time, std::span<MovingSheet> sheets);
// Gives held particles the velocity of their paths in a step from `time` on.
void set_pin_velocities(const std::vector<Pin>& pins, double time, double dt, Matrix3Xd& v);

}  // namespace weft

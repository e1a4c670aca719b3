#pragma once

#include <string>

#include "core/model/mesh.h"

namespace weft {

// Farthest position and speed of a frame, m and m/s: what lies beyond counts as not finite.
inline constexpr double kFarthest = 1e9;
// Largest strain of a frame, unless the start or a motion that was confirmed had half of its own.
inline constexpr double kMostStrain = 10;

// What rounding may bring a sheet to that lies still, m/s.
inline constexpr double kStillSpeed = 1e-4;

// A sheet at the end of a frame. (3 x particles)
struct SheetState {
  Matrix3Xd x;                // m
  Matrix3Xd v;                // m/s
  double kinetic_energy = 0;  // J
};
double kinetic_energy(const Mesh& mesh, const Matrix3Xd& v);

// What drives a sheet in a frame, beside its elastic forces.
struct Drive {
  Vector3d gravity = Vector3d::Zero();  // m/s^2
  double speed = 0;                     // the fastest of its pins, the colliders and the wind, m/s
  double frame_step = 0;                // s
  double given = 0;                     // to all cloth that may touch it, by other things, J
};

// The fastest that pins and colliders move between two times, m/s.
double motion_speed(const Scene& scene, const SheetDefinition& sheet, double begin, double end);
// The fastest that a wind blows, m/s.
double wind_speed(const Scene& scene);
// The fastest that anything drives a sheet between two times, m/s.
double drive_speed(const Scene& scene, const SheetDefinition& sheet, double begin, double end);

// What the guard saw of a sheet after a frame.
struct Inspection {
  std::string reason;  // why the frame is not to be trusted; empty: nothing speaks against it
  bool finite = true;
  double strain = 0;  // largest of the stretch connections
  double energy = 0;  // kinetic, elastic and gravity, J; where the reason is energy
};

// Looks for a sheet that diverged: a position or velocity that is not finite; a strain above
// `most_strain`; energy (kinetic, elastic and gravity) that grew by more than the sheet had at
// `before`, as motion and elastic energy, plus 10 M (u^2 + (g T)^2), u the speed of the drive, at
// least kStillSpeed, and T the frame step, and what was given. Energies are added up only where the
// kinetic one calls for it.
Inspection inspect(const Mesh& mesh, const Drive& drive, double most_strain,
                   const SheetState& before, const SheetState& after);

// The same, for what is not finite alone.
Inspection inspect_finite(const SheetState& after);

// Whether two attempts at a frame, one of them at half the step of the other, show a motion of the
// sheet rather than a divergence: within a quarter of each other.
bool confirms(const Inspection& one, const Inspection& other);

}  // namespace weft

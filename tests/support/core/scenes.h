#pragma once

#include <cstdint>

#include "core/lattice/lattice.h"
#include "core/simulation.h"

namespace weft::testing {

// The paper's textile on a mesh: 1 g, k = 2000 N/m, k_d = 2e-4 kg/s.
Textile paper_textile(double bend = 1e-5);

// A soft one for triangles: 200 N/m, 20 N/m in shear, 1e-5 N m.
MeasuredTextile light_textile(double areal_density);

// A flat sheet of the paper's textile at the origin.
SheetDefinition flat_sheet(int rows, int columns, double spacing = 1.0 / 30);

// One sheet without gravity, colliders or pins.
Scene floating(const SheetDefinition& sheet);

// Fixed pseudo-random numbers in -1 ... 1.
Matrix3Xd noise(int particles, unsigned seed = 1);

// (3 x particles) of all sheets.
Matrix3Xd positions(const Simulation& simulation);
// FNV-1a over the bits of all values.
std::uint64_t hash_of(const Matrix3Xd& values);
Matrix3Xd velocities(const Simulation& simulation);

// Start positions and velocities in the order of a scene.
std::vector<double> values(const Matrix3Xd& columns);

// Positions of a sheet stretched by `strain` in its plane.
Matrix3Xd stretched(const SheetDefinition& sheet, double strain);

// How far a sheet without springs comes down an incline that is turned so, m: each particle is a
// block of the textbook, its friction that of the incline. start: of its corner, before the turn,
// m.
double slide_on(const Collider& incline, const Quaterniond& turn, const Vector3d& start,
                double seconds);

}  // namespace weft::testing

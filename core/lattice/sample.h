#pragma once

#include <vector>

#include "core/lattice/lattice.h"

namespace weft {

// A window of a lattice, free of pins. Modes that limit a step are as short as its spacing: those
// of a window with a corner of the lattice are within 3e-4 of its own, where all is alike.
struct LatticeSample {
  Mesh mesh;
  std::vector<int> particles;  // of the lattice
};

// Whether all of it would take longer than users wait: for anything, and for the estimate of its
// step at one shape.
bool is_large(const SheetShape& shape);
bool is_sampled(const SheetShape& shape);

// At its first corner, or about a particle. Precondition: is_sampled(grid).
LatticeSample sample_of(const Grid& grid, const Mesh& mesh, int particle = 0);

// Where the connections that stretch are strained most.
int tautest_particle(const Mesh& mesh, const Matrix3Xd& x);

}  // namespace weft

#pragma once

#include "core/simulation.h"

namespace weft::testing {

inline constexpr int kTubeColumns = 20, kTubeRows = 10;  // of a panel
inline constexpr double kPanelWidth = 0.2;               // m

// Two rectangles on both sides of x = y = 0, sewn along their sides to a tube about y. Particles on
// the seams lie between the panels.
TriangleMesh sewn_tube();
// The tube, to be put around a pole.
Scene around_pole(double radius);
// Fails the test where a frame fails.
void dress(Simulation& simulation, int frames);
// Around the tube at a row, m.
double girth(const Simulation& simulation, int row);

}  // namespace weft::testing

#pragma once

#include "core/lab/specimen.h"

namespace weft {

// A disc about the origin in the plane y = 0, of whole cells of a lattice, whose middle is held: a
// quarter of a spacing beyond held_radius, for a clamp acts inside the last particles held (half a
// spacing along an axis, less on a staircase). m
Specimen cut_disc(const MeasuredTextile& textile, const BendingLaw& bending, double radius,
                  double held_radius, double spacing);

// The same of triangles, with a round outline. Held up to a spacing beyond held_radius: the last
// particles held lie half a spacing beyond it in the mean, and the clamp acts as far inside them.
Specimen cut_disc(const MeasuredTextile& textile, const BendingLaw& bending, Cut mesh,
                  double radius, double held_radius, double spacing);

// What a disc of a given spacing has at most, with all around it.
double drape_particles(double spacing);

// ISO 9073-9 (Cusick 1968): a disc of 300 mm held between discs of 180 mm hangs under its weight;
// light from above gives a shadow. Precondition: find_problems(order) is empty.
LabReport drape(const LabOrder& order, const LabWatch& watch);

}  // namespace weft

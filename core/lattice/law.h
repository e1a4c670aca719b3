#pragma once

#include "core/lattice/lattice.h"
#include "core/lattice/sweep.h"

namespace weft {

// What a sweep needs to know of a sheet, but for damping, drag and drift, which depend on the step.
// Precondition: the evaluator is LINEARIZED or POLYNOMIAL, or the law ISOMETRIC.
template <class T>
SweepLaw<T> make_sweep_law(const SheetDefinition& sheet);

}  // namespace weft

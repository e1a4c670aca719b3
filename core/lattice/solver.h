#pragma once

#include <memory>
#include <optional>

#include "core/lattice/lattice.h"
#include "core/motion/sheet_solver.h"

namespace weft {

// Rows of a lattice in vectors: Verlet. `dynamics` are the same forces in double, for
// starts; both must outlive the solver.
std::unique_ptr<SheetSolver> make_lattice_solver(const SheetDefinition& sheet,
                                                 const Dynamics& dynamics,
                                                 const std::optional<Wind>& wind,
                                                 const SolverSettings& settings);

}  // namespace weft

#pragma once

#include <memory>
#include <optional>

#include "core/motion/sheet_solver.h"

namespace weft {

// A sheet of triangles in vectors: Verlet. `dynamics` are the same forces in double, for starts.
// Both it and the mesh must outlive the solver.
std::unique_ptr<SheetSolver> make_triangle_solver(const Mesh& mesh, const Dynamics& dynamics,
                                                  const std::optional<Wind>& wind,
                                                  const SolverSettings& settings);

}  // namespace weft

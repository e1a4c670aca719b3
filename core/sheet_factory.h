#pragma once

#include <functional>
#include <memory>
#include <string_view>

#include "core/model/mesh.h"
#include "core/motion/sheet_solver.h"

namespace weft {

// Where kinds of sheets are told apart: what a sheet's shape asks for.

Mesh make_mesh(const SheetDefinition& sheet);

// Makes what moves a sheet, of which `mesh` was made; it and `dynamics` outlive it.
using SolverFactory = std::function<std::unique_ptr<SheetSolver>(
    const Scene& scene, const SheetDefinition& sheet, const Mesh& mesh, const Dynamics& dynamics)>;

// The fastest that can.
std::unique_ptr<SheetSolver> make_solver(const Scene& scene, const SheetDefinition& sheet,
                                         const Mesh& mesh, const Dynamics& dynamics);

// Why only the plain solver can move a sheet; empty where vectors can.
std::string_view needs_plain_solver(const Scene& scene, const SheetDefinition& sheet);

}  // namespace weft

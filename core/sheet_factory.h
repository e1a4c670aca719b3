#pragma once

#include <functional>
#include <memory>
#include <string_view>

#include "core/model/mesh.h"
#include "core/motion/sheet_solver.h"
#include "core/motion/stability.h"

namespace weft {

// Where kinds of sheets are told apart: what a sheet's shape asks for.

Mesh make_mesh(const SheetDefinition& sheet);

// Gives a mesh, made of the sheet, a rest shape between that of its start (share 0) and its flat
// one (1). Of a lattice they are the same.
void ease_rest_shape(const SheetDefinition& sheet, double share, Mesh& mesh);
// Which of its triangles start along seams that are to close; empty: none.
std::vector<bool> triangles_at_open_seams(const SheetDefinition& sheet);

// As stable_step(), unsheared_gain() and damping_for(); of large lattices by samples of them.
StableStep stable_step_of(const SheetDefinition& sheet, const Mesh& mesh,
                          const VectorXd& inverse_mass, IntegratorKind integrator, double air_rate,
                          const Matrix3Xd& x);
// 1 where that is not known.
double unsheared_gain_of(const SheetDefinition& sheet, const Mesh& mesh,
                         const VectorXd& inverse_mass, IntegratorKind integrator, double air_rate);
double damping_of(const SheetDefinition& sheet, const Mesh& mesh, double ratio);
// Of the flat sheet, m^2.
double area_of(const SheetDefinition& sheet);

// What keeps a sheet's free particles within the reach of held ones, if it asks for that.
Tethers make_tethers(const SheetDefinition& sheet);

// Makes what moves a sheet, of which `mesh` was made; it and `dynamics` outlive it.
using SolverFactory = std::function<std::unique_ptr<SheetSolver>(
    const Scene& scene, const SheetDefinition& sheet, const Mesh& mesh, const Dynamics& dynamics)>;

// The fastest that can.
std::unique_ptr<SheetSolver> make_solver(const Scene& scene, const SheetDefinition& sheet,
                                         const Mesh& mesh, const Dynamics& dynamics);

// Why only the plain solver can move a sheet; empty where vectors can.
std::string_view needs_plain_solver(const Scene& scene, const SheetDefinition& sheet);

}  // namespace weft

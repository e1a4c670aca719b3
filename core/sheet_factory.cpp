#include "core/sheet_factory.h"

#include "core/lattice/lattice.h"
#include "core/lattice/solver.h"
#include "core/triangles/solver.h"
#include "core/triangles/triangles.h"

namespace weft {

Mesh make_mesh(const SheetDefinition& sheet) {
  return std::holds_alternative<Grid>(sheet.shape) ? make_lattice(sheet) : make_triangles(sheet);
}

std::unique_ptr<SheetSolver> make_solver(const Scene& scene, const SheetDefinition& sheet,
                                         const Mesh& mesh, const Dynamics& dynamics) {
  if (!needs_plain_solver(scene, sheet).empty())
    return make_plain_solver(dynamics, scene.solver.integrator);
  if (std::holds_alternative<Triangles>(sheet.shape))
    return make_triangle_solver(mesh, dynamics, scene.environment.wind, scene.solver);
  return make_lattice_solver(sheet, dynamics, scene.environment.wind, scene.solver);
}

std::string_view needs_plain_solver(const Scene& scene, const SheetDefinition& sheet) {
  if (scene.solver.plain) return "asked for";
  if (scene.solver.integrator != IntegratorKind::kVerlet) return "the integrator is not VERLET";
  const auto* law = std::get_if<ChoiKo>(&sheet.bending);
  if (law != nullptr && std::holds_alternative<Triangles>(sheet.shape))
    return "CHOI_KO on triangles";
  const bool slow = law != nullptr &&
                    (law->evaluator == Evaluator::kSeries || law->evaluator == Evaluator::kExact);
  return slow ? "the evaluator is SERIES or EXACT" : "";
}

}  // namespace weft

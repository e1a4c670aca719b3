#include "core/sheet_factory.h"

#include <algorithm>
#include <limits>

#include "core/lattice/lattice.h"
#include "core/lattice/sample.h"
#include "core/lattice/solver.h"
#include "core/lattice/tethers.h"
#include "core/triangles/ease.h"
#include "core/triangles/geodesics.h"
#include "core/triangles/solver.h"
#include "core/triangles/triangles.h"

namespace weft {

Mesh make_mesh(const SheetDefinition& sheet) {
  return std::holds_alternative<Grid>(sheet.shape) ? make_lattice(sheet) : make_triangles(sheet);
}

void ease_rest_shape(const SheetDefinition& sheet, double share, Mesh& mesh) {
  if (std::holds_alternative<Triangles>(sheet.shape)) ease(sheet, share, mesh);
}

std::vector<bool> triangles_at_open_seams(const SheetDefinition& sheet) {
  if (!std::holds_alternative<Triangles>(sheet.shape)) return {};
  return stretched_at_start(sheet);
}

StableStep stable_step_of(const SheetDefinition& sheet, const Mesh& mesh,
                          const VectorXd& inverse_mass, IntegratorKind integrator, double air_rate,
                          const Matrix3Xd& x) {
  if (!is_sampled(sheet.shape)) return stable_step(mesh, inverse_mass, integrator, air_rate, x);
  const auto step_of = [&](int particle) {
    const LatticeSample sample = sample_of(grid_of(sheet), mesh, particle);
    return stable_step(sample.mesh, sample.mesh.mass.cwiseInverse(), integrator, air_rate,
                       x(Eigen::all, sample.particles));
  };
  StableStep step = step_of(0);
  if (!is_large(sheet.shape)) {
    const double estimate = step.estimate;
    step = stable_step(mesh, inverse_mass, integrator, air_rate, {});
    step.estimate = estimate;
  }
  if (const int tautest = tautest_particle(mesh, x); tautest > 0)
    step.estimate = std::min(step.estimate, step_of(tautest).estimate);
  return step;
}

double unsheared_gain_of(const SheetDefinition& sheet, const Mesh& mesh,
                         const VectorXd& inverse_mass, IntegratorKind integrator, double air_rate) {
  const auto* grid = std::get_if<Grid>(&sheet.shape);
  if (grid == nullptr && std::holds_alternative<ChoiKo>(sheet.bending)) return 1;
  if (grid == nullptr) return unsheared_gain(mesh, inverse_mass, integrator, air_rate, {});
  SheetDefinition level;
  level.shape = *grid;
  const Matrix3Xd flat = start_positions(level);
  if (!is_large(sheet.shape)) return unsheared_gain(mesh, inverse_mass, integrator, air_rate, flat);
  const LatticeSample sample = sample_of(*grid, mesh);
  return unsheared_gain(sample.mesh, sample.mesh.mass.cwiseInverse(), integrator, air_rate,
                        flat(Eigen::all, sample.particles));
}

double damping_of(const SheetDefinition& sheet, const Mesh& mesh, double ratio) {
  if (!is_large(sheet.shape)) return damping_for(mesh, ratio);
  return damping_for(sample_of(grid_of(sheet), mesh).mesh, ratio);
}

double area_of(const SheetDefinition& sheet) {
  if (std::holds_alternative<Triangles>(sheet.shape))
    return areas(rest_shape(triangles_in(sheet))).sum();
  const auto [warp, weft] = extent(sheet.shape);
  return warp * weft * sheet.spacing() * sheet.spacing();
}

Tethers make_tethers(const SheetDefinition& sheet) {
  if (!sheet.tether_stretch) return {};
  Tethers tethers = find_attachments(sheet);
  if (const auto* grid = std::get_if<Grid>(&sheet.shape))
    measure_tethers(*grid, tethers);
  else
    measure_tethers(rest_shape(triangles_in(sheet)), tethers);
  for (Attachment& attachment : tethers) {
    for (double& length : attachment.length) length *= 1 + *sheet.tether_stretch;
    for (const Pin& pin : sheet.pins)
      for (const int i : pin.particles)
        attachment.length[static_cast<std::size_t>(i)] = std::numeric_limits<double>::infinity();
  }
  return tethers;
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
  if (!is_verlet(scene.solver.integrator)) return "the integrator is not VERLET";
  const auto* law = std::get_if<ChoiKo>(&sheet.bending);
  if (law != nullptr && std::holds_alternative<Triangles>(sheet.shape))
    return "CHOI_KO on triangles";
  const bool slow = law != nullptr &&
                    (law->evaluator == Evaluator::kSeries || law->evaluator == Evaluator::kExact);
  return slow ? "the evaluator is SERIES or EXACT" : "";
}

}  // namespace weft

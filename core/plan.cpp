#include "core/plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/cloth_contact/cloth_contact.h"
#include "core/contact/moving_bodies.h"
#include "core/model/text.h"
#include "core/motion/stability.h"
#include "core/plan_warnings.h"
#include "core/sheet_factory.h"
#include "core/tether_warnings.h"
#include "core/triangles/triangles.h"
#include "core/triangles/warnings.h"

namespace weft {
namespace {

// Of a particle, at most, m^2/kg.
double area_by_mass(const SheetDefinition& sheet, const Mesh& mesh) {
  if (std::holds_alternative<Triangles>(sheet.shape) &&
      std::holds_alternative<MeasuredTextile>(sheet.textile.model))
    return 1 / least_density(sheet);
  return sheet.spacing() * sheet.spacing() / mesh.mass.minCoeff();
}

// Rate at which wind damps a sheet that is nearly at rest, 1/s.
double wind_rate(const Scene& scene, double area_by_mass) {
  if (!scene.environment.wind) return 0;
  const Wind& wind = *scene.environment.wind;
  const double speed = wind.velocity.norm() * (1 + wind.gust);
  return (wind.air_density * speed + wind.tangential_drag) * area_by_mass;
}

// Rate at which air damps a sheet that is nearly at rest, an upper estimate, 1/s. Verlet takes drag
// centred, which no step is too long for.
double air_rate(const Scene& scene, const SheetDefinition& sheet, const Mesh& mesh) {
  double rate = 0;
  if (!is_verlet(scene.solver.integrator) && mesh.drag.size() > 0)
    rate += mesh.drag.cwiseQuotient(mesh.mass).maxCoeff();
  rate += wind_rate(scene, area_by_mass(sheet, mesh));
  return rate;
}

// Of each sheet.
std::vector<StableStep> stable_steps(const Scene& scene, const std::vector<PlannedSheet>& planned) {
  std::vector<StableStep> steps;
  for (std::size_t s = 0; s < planned.size(); ++s) {
    const PlannedSheet& sheet = planned[s];
    steps.push_back(stable_step_of(scene.sheets[s], sheet.mesh, sheet.inverse_mass,
                                   scene.solver.integrator,
                                   air_rate(scene, scene.sheets[s], sheet.mesh), sheet.x));
  }
  return steps;
}

// By how much the step may be longer than one for every shape.
double gain_of(const Scene& scene, const std::vector<PlannedSheet>& planned,
               const std::vector<StableStep>& steps) {
  const SolverSettings& solver = scene.solver;
  if (solver.step_bound != StepBound::kUnsheared || !is_verlet(solver.integrator)) return 1;
  double gain = std::numeric_limits<double>::infinity();
  for (std::size_t s = 0; s < planned.size(); ++s) {
    const auto& [mesh, inverse_mass, x, tethers] = planned[s];
    const double share = unsheared_share(mesh, steps[s].connection_ratio);
    if (share == 0) return 1;
    const double most = unsheared_gain_of(scene.sheets[s], mesh, inverse_mass, solver.integrator,
                                          air_rate(scene, scene.sheets[s], mesh));
    gain = std::min(gain, 1 + share * (most - 1));
  }
  return gain;
}

StepPlan plan_step(const Scene& scene, const std::vector<StableStep>& sheets, double gain) {
  const SolverSettings& solver = scene.solver;
  StepPlan step;
  step.linear_bound = step.estimated_bound = std::numeric_limits<double>::infinity();
  double safe = step.linear_bound;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const StableStep& stable = sheets[s];
    safe = std::min(safe, borne_share(solver, stable) * stable.linear_bound);
    step.estimated_bound = std::min(step.estimated_bound, stable.estimate);
    if (s > 0 && stable.linear_bound >= step.linear_bound) continue;
    step.linear_bound = stable.linear_bound;
    step.damping_ratio = stable.damping_ratio;
    step.limiting_sheet = scene.sheets[s].name;
  }

  if (solver.step_bound == StepBound::kUnsheared) step.unsheared_bound = gain * step.linear_bound;

  // an asked step that divides the frame step up to rounding is taken as it is
  constexpr double kRounding = 1e-9;
  const double longest = solver.substep.value_or(gain * safe);
  const double count = std::ceil(solver.frame_step / longest * (1 - kRounding));
  step.substeps = static_cast<std::int64_t>(std::clamp(count, 1.0, 1e18));
  step.substep = solver.frame_step / static_cast<double>(step.substeps);
  return step;
}

// Of the isometric law, at most: omega^2, 1/s^2.
double bending_stiffness(const PlannedSheet& sheet) {
  VectorXd rows = VectorXd::Zero(sheet.inverse_mass.size());
  for (const Stencil& stencil : sheet.mesh.stencils) {
    double weights = 0;
    for (const double weight : stencil.weight) weights += std::abs(weight);
    for (std::size_t k = 0; k < 4; ++k)
      rows[stencil.particle[k]] += std::abs(stencil.weight[k]) * weights * stencil.stiffness;
  }
  return rows.cwiseProduct(sheet.inverse_mass).maxCoeff();
}

// Substeps in one of which slow forces may act: as many as the scene bears, where they then are a
// small part of what bounds the step, and where impulses in time with the stiffest modes feed these
// by less than damping takes away, that of a relaxation too. Drag alone costs too little to wait.
int slow_every(const Scene& scene, const std::vector<PlannedSheet>& planned,
               const std::vector<StableStep>& steps, const StepPlan& step) {
  constexpr double kMostOfBound = 0.25;  // of 4
  std::int64_t every = std::min<std::int64_t>(scene.solver.slow_forces_every, step.substeps);
  if (every == 1 || !is_verlet(scene.solver.integrator)) return 1;
  const bool only_drag = std::ranges::all_of(
      planned, [](const PlannedSheet& sheet) { return sheet.mesh.stencils.empty(); });
  if (only_drag && !scene.environment.wind) return 1;
  const double dt = step.substep;
  for (std::size_t s = 0; s < planned.size(); ++s) {
    const Mesh& mesh = planned[s].mesh;
    const double stiffness = dt * dt * bending_stiffness(planned[s]);
    if (stiffness > std::min(steps[s].connection_ratio, 2 * kSafeDampingRatio)) return 1;
    const SheetDefinition& sheet = scene.sheets[s];
    // particles on the border of a grid have as much less area as mass
    double rate = wind_rate(scene, std::holds_alternative<Grid>(sheet.shape)
                                       ? sheet.spacing() * sheet.spacing() / mesh.mass.maxCoeff()
                                       : area_by_mass(sheet, mesh));
    if (mesh.drag.size() > 0) rate += mesh.drag.cwiseQuotient(mesh.mass).maxCoeff();
    const double share = 4 * dt * rate + stiffness;
    if (share > 0)
      every = std::min(every, static_cast<std::int64_t>(std::min(1e9, kMostOfBound / share)));
  }
  return static_cast<int>(std::max<std::int64_t>(every, 1));
}

void describe_solver(const Scene& scene, const SheetDefinition& sheet, Plan& plan) {
  const std::string_view reason = needs_plain_solver(scene, sheet);
  if (!reason.empty()) {
    plan.skipped.push_back({join(sheet.name, ": vector kernels"), std::string(reason)});
    return;
  }
  const bool single = scene.solver.precision == Precision::kSingle;
  plan.passes.push_back(
      join(sheet.name, ": vector kernels in ", single ? "single" : "double", " precision"));
}

// Of slow forces.
std::string how_often(const Plan& plan) {
  return plan.step.slow_every == 1 ? "" : join(", every ", plan.step.slow_every, " substeps");
}

void describe_connections(const SheetDefinition& sheet, const Mesh& mesh, Plan& plan) {
  const bool pushes = resists_compression(sheet.bending);
  const auto describe = [&](FamilyKind kind, const char* name, const std::string& why_idle) {
    std::size_t pulling = 0;
    for (const Family& family : mesh.families)
      if (family.kind == kind && (family.stiffness > 0 || family.bend))
        pulling += family.connections.size();
    const std::string pass = join(sheet.name, ": ", name);
    if (pulling > 0)
      plan.passes.push_back(
          join(pass, ", ", pulling, " connections",
               pushes && kind == FamilyKind::kStretch ? " that resist compression too" : ""));
    else
      plan.skipped.push_back({pass, why_idle});
  };
  describe(FamilyKind::kStretch, "stretch", "its stiffness is 0");
  describe(FamilyKind::kShear, "shear", "its stiffness is 0");
  if (const auto* law = std::get_if<ChoiKo>(&sheet.bending)) {
    const char* no_bend = "k_b or c_b is 0, or the sheet is too small";
    describe(FamilyKind::kBend, "bend", no_bend);
    describe(FamilyKind::kDiagonalBend, "diagonal bend",
             law->diagonal_bend ? no_bend : "diagonal_bend is off");
  } else if (!mesh.stencils.empty()) {
    plan.passes.push_back(
        join(sheet.name, ": isometric bend, ", mesh.stencils.size(), " stencils", how_often(plan)));
  } else {
    plan.skipped.push_back({join(sheet.name, ": isometric bend"), "the bending rigidity is 0"});
  }
}

// What frames show between the particles that are simulated costs who asks for them.
void describe_interpolation(const SheetDefinition& sheet, Plan& plan) {
  if (!is_interpolated(sheet.shape)) return;
  const int all = particle_count(shown(sheet.shape)), simulated = sheet.particle_count();
  plan.skipped.push_back(
      {join(sheet.name, ": ", all - simulated, " of ", all, " particles"),
       join("each row and column number ", std::get<Grid>(sheet.shape).simulated_every,
            " is simulated, ", simulated, " particles; frames interpolate the others")});
}

void describe_forces(const SheetDefinition& sheet, const Mesh& mesh, Plan& plan) {
  if (std::holds_alternative<Triangles>(sheet.shape) &&
      std::holds_alternative<Isometric>(sheet.bending))
    describe_surface(sheet, mesh, plan);
  else
    describe_connections(sheet, mesh, plan);
  if (mesh.damping > 0)
    plan.passes.push_back(join(sheet.name, ": damping"));
  else
    plan.skipped.push_back({join(sheet.name, ": damping"), "k_d is 0"});
  if (mesh.drag.size() > 0)
    plan.passes.push_back(join(sheet.name, ": drag", how_often(plan)));
  else
    plan.skipped.push_back({join(sheet.name, ": drag"), "the textile has no air drag"});
}

// Precondition: the step is planned.
void describe_cloth_contact(const Scene& scene, Plan& plan) {
  if (!scene.cloth_contact) {
    plan.skipped.push_back({"cloth contact", "cloth_contact is not set"});
    return;
  }
  const int steps = ClothContact::most_steps(scene.solver, plan.step.substep);
  for (const SheetDefinition& sheet : scene.sheets)
    plan.passes.push_back(join(sheet.name, ": cloth contact at ", sheet.thickness_or_default(),
                               " m, ", triangle_count(sheet.shape), " triangles, every ",
                               steps == 1 ? "substep" : join(steps, " substeps or fewer")));
}

void describe_poses(const Scene& scene, Plan& plan) {
  for (const Collider& collider : scene.colliders) {
    if (!collider.poses) continue;
    const Body& body = *std::get<SharedBody>(collider.shape);
    plan.passes.push_back(join(collider.name, ": ", collider.poses->times.size(), " poses, ",
                               count_grids(*collider.poses, body.grid.cell), " grids of ",
                               body.mesh.triangles.size(), " triangles, cells of ", body.grid.cell,
                               " m"));
  }
}

}  // namespace

int StepPlan::slow_in(std::int64_t k) const {
  const std::int64_t group = k / slow_every, first = group * slow_every;
  const std::int64_t size = std::min<std::int64_t>(slow_every, substeps - first);
  const std::int64_t middle = std::min((size + group % 2) / 2, size - 1);
  return k == first + middle ? static_cast<int>(size) : 0;
}

std::optional<StepRefusal> find_refusal(const StepPlan& step, const SolverSettings& solver,
                                        std::int64_t most_substeps) {
  const bool unstable = step.substep > step.longest() && !solver.allow_unstable;
  if (!unstable && step.substeps <= most_substeps) return std::nullopt;
  return StepRefusal{step.substep, step.longest(), !unstable, step.substeps, most_substeps};
}

Plan make_plan(const Scene& scene, const std::vector<PlannedSheet>& sheets) {
  Plan plan;
  const std::vector<StableStep> steps = stable_steps(scene, sheets);
  plan.step = plan_step(scene, steps, gain_of(scene, sheets, steps));
  plan.step.slow_every = slow_every(scene, sheets, steps, plan.step);
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    plan.dampings.push_back(
        {scene.sheets[s].name, sheets[s].mesh.damping, steps[s].connection_ratio});
    describe_interpolation(scene.sheets[s], plan);
    describe_solver(scene, scene.sheets[s], plan);
    describe_forces(scene.sheets[s], sheets[s].mesh, plan);
    describe_tethers(scene, s, sheets[s], plan);
    plan.particle_substeps += scene.sheets[s].particle_count() / plan.step.substep;
  }
  const auto pass = [&](const std::string& name, bool runs, const char* why_not) {
    if (runs)
      plan.passes.emplace_back(name);
    else
      plan.skipped.push_back({name, why_not});
  };
  const bool windy = scene.environment.wind.has_value();
  pass(windy ? "wind" + how_often(plan) : "wind", windy, "the scene has none");
  pass("contact", !scene.colliders.empty(), "the scene has no collider");
  describe_poses(scene, plan);
  describe_cloth_contact(scene, plan);
  warn(scene, sheets, steps, plan);
  return plan;
}

}  // namespace weft

#include "core/plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "core/cloth_contact/cloth_contact.h"
#include "core/contact/contact.h"
#include "core/contact/moving_bodies.h"
#include "core/model/self_weight.h"
#include "core/model/text.h"
#include "core/motion/stability.h"
#include "core/sheet_factory.h"
#include "core/tether_warnings.h"
#include "core/triangles/triangles.h"
#include "core/triangles/warnings.h"

namespace weft {
namespace {

std::string sheet_path(std::size_t index) { return "sheets[" + std::to_string(index) + "]"; }

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

// The longest step that a sheet's damping bears, as a share of its linear bound.
double share_of(const SolverSettings& solver, const StableStep& stable) {
  if (!is_verlet(solver.integrator)) return solver.safety;
  return std::min(solver.safety, safe_share(stable.connection_ratio));
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
    safe = std::min(safe, share_of(solver, stable) * stable.linear_bound);
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
// by less than damping takes away, that of a relaxation too.
int slow_every(const Scene& scene, const std::vector<PlannedSheet>& planned,
               const std::vector<StableStep>& steps, const StepPlan& step) {
  constexpr double kMostOfBound = 0.25;  // of 4
  std::int64_t every = std::min<std::int64_t>(scene.solver.slow_forces_every, step.substeps);
  if (every == 1 || !is_verlet(scene.solver.integrator)) return 1;
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

// B and c_b along warp and weft, N m and N/m, and the weight of an area, Pa.
struct Stiffness {
  double weight;
  std::array<std::pair<double, double>, 2> rigidity_and_clamp;
};
Stiffness stiffness_of(const SheetDefinition& sheet, double gravity) {
  if (const auto* raw = std::get_if<RawTextile>(&sheet.textile.model)) {
    const double h = sheet.spacing();
    const std::pair both(1.5 * raw->bend / h, raw->clamp.value_or(raw->stretch));  // k_b = 2/3 B h
    return {raw->particle_mass / (h * h) * gravity, {both, both}};
  }
  const auto& measured = std::get<MeasuredTextile>(sheet.textile.model);
  return {measured.areal_density * gravity,
          {std::pair(measured.bend_rigidity_warp, measured.tensile_warp),
           std::pair(measured.bend_rigidity_weft, measured.tensile_weft)}};
}

// kappa*, the largest of all axes, and h_min = (96 B / (c_b kappa^2))^(1/4) / 2 at the curvature
// that the sheet's weight gives it, kappa = (rho g / B)^(1/3).
std::optional<BendingLimit> bending_limit(const Scene& scene, const SheetDefinition& sheet,
                                          const Mesh& mesh) {
  BendingLimit limit{sheet.name, 0, 0};
  for (const Family& family : mesh.families)
    if (family.kind == FamilyKind::kBend && family.bend)
      limit.least_curvature = std::max(limit.least_curvature, family.bend->least_curvature());
  if (limit.least_curvature == 0) return std::nullopt;

  const double given = scene.environment.gravity.norm();
  const Stiffness stiffness = stiffness_of(sheet, given > 0 ? given : kStandardGravity);
  for (const auto& [rigidity, clamp] : stiffness.rigidity_and_clamp) {
    if (rigidity == 0 || clamp == 0) continue;
    const double kappa = std::cbrt(stiffness.weight / rigidity);
    limit.finest_spacing =
        std::max(limit.finest_spacing, std::pow(96 * rigidity / (clamp * kappa * kappa), 0.25) / 2);
  }
  return limit;
}

void warn_of_bending(const Scene& scene, std::size_t index, const Mesh& mesh, Plan& plan) {
  const SheetDefinition& sheet = scene.sheets[index];
  const auto* law = std::get_if<ChoiKo>(&sheet.bending);
  if (law == nullptr) return;

  std::size_t inert = 0, bending = 0;
  for (const Family& family : mesh.families) {
    bending += family.bend ? 1 : 0;
    inert += family.bend && family.bend->clamp_rules() ? 1 : 0;
  }
  if (inert > 0)
    plan.warnings.push_back(
        {"CLAMP_RULES", sheet_path(index) + ".textile",
         join("c_b L^3 / k_b is below ", kClampRules, inert == bending ? " for every" : " for some",
              " bend connection: the clamp of eq. 5 rules there, so k_b and the evaluator have no "
              "effect. Use a smaller k_b, a larger c_b, a larger spacing, or ISOMETRIC")});

  const auto limit = bending_limit(scene, sheet, mesh);
  if (!limit) return;
  plan.bending_limits.push_back(*limit);
  if (sheet.spacing() < limit->finest_spacing)
    plan.warnings.push_back(
        {"MESH_TOO_FINE", sheet_path(index) + ".grid.spacing_m",
         join(
             "a spacing of ", sheet.spacing(), " m is below ", limit->finest_spacing,
             " m, under which interlaced connections lose the bending rigidity of this textile: it "
             "will hang too limp. Use a larger spacing or ISOMETRIC")});

  const auto* measured = std::get_if<MeasuredTextile>(&sheet.textile.model);
  if (measured == nullptr || !law->diagonal_bend) return;
  const auto [soft, stiff] =
      std::minmax(measured->bend_rigidity_warp, measured->bend_rigidity_weft);
  if (stiff > 5 * soft)
    plan.warnings.push_back(
        {"BENDING_TOO_UNEQUAL", sheet_path(index) + ".textile.measured",
         join("the rigidities of ", soft, " and ", stiff,
              " N m are more than 5 apart: the diagonals alone are stiffer than the softer "
              "direction. Turn diagonal_bend off, or use ISOMETRIC")});
}

// Held at constant width, the diagonals pull along with the threads.
void warn_of_tension(const SheetDefinition& sheet, std::size_t index, Plan& plan) {
  const auto* measured = std::get_if<MeasuredTextile>(&sheet.textile.model);
  if (measured == nullptr) return;
  const double softest = std::min(measured->tensile_warp, measured->tensile_weft);
  if (2 * measured->shear > 0.1 * softest)
    plan.warnings.push_back({"SHEAR_STIFFENS_TENSION",
                             sheet_path(index) + ".textile.measured.shear_n_per_m",
                             join("a strip held at constant width measures E + 2 G, up to ",
                                  softest + 2 * measured->shear, " instead of ", softest,
                                  " N/m: the shear connections pull along with the threads")});
}

std::string stiffness_text(const Textile& textile) {
  if (const auto* raw = std::get_if<RawTextile>(&textile.model))
    return join(raw->stretch, " N/m, in shear ", raw->shear, " N/m");
  const auto& measured = std::get<MeasuredTextile>(textile.model);
  return join(measured.tensile_warp, " and ", measured.tensile_weft, " N/m, in shear ",
              measured.shear, " N/m");
}

void describe_stretch(const Scene& scene, std::size_t index, Plan& plan) {
  const SheetDefinition& sheet = scene.sheets[index];
  const SelfWeightStrain strain = self_weight_strain(sheet, scene.environment);
  plan.stretch_costs.push_back({sheet.name, std::max(strain.warp, strain.weft)});
  if (!scene.solver.max_self_weight_strain) return;
  const double most = *scene.solver.max_self_weight_strain;
  SheetDefinition capped = sheet;
  cap_stretch(capped, scene.environment, most);
  if (capped.textile == sheet.textile) return;
  plan.warnings.push_back(
      {"STRETCH_CAPPED", sheet_path(index) + ".textile",
       join("a tensile stiffness of ", stiffness_text(sheet.textile), ", is simulated as ",
            stiffness_text(capped.textile),
            ", with which the sheet, hung by an edge, stretches by ", 100 * most,
            " % under its own weight (solver.max_self_weight_strain)")});
}

// Where damping is so low that energy may come from nothing.
void warn_of_damping(const Scene& scene, const std::vector<PlannedSheet>& planned,
                     std::size_t index, const StableStep& stable, Plan& plan) {
  const Textile& textile = scene.sheets[index].textile;
  const Mesh& mesh = planned[index].mesh;
  const double ratio = stable.connection_ratio;
  const std::string field = sheet_path(index) + ".textile";
  constexpr const char* kWhy =
      ": connections that switch between taut and slack gain energy from nothing";
  if (!textile.damping && !textile.damping_ratio && mesh.damping > kDefaultDamping) {
    plan.warnings.push_back(
        {"UNDERDAMPED", field,
         join("gives no damping, and the default of ", kDefaultDamping,
              " kg/s would be a damping ratio of ", ratio * kDefaultDamping / mesh.damping,
              " of the stiffest mode", kWhy, ". Simulated with ", mesh.damping,
              " kg/s, a ratio of ", ratio, ", which costs less than 1 % of the step")});
    return;
  }
  if (!is_verlet(scene.solver.integrator) || safe_share(ratio) == 1) return;
  const double safe = share_of(scene.solver, stable) * stable.linear_bound;
  const double enough = damping_of(scene.sheets[index], mesh, kSafeDampingRatio);
  if (const auto& asked = scene.solver.substep; asked && *asked > safe * (1 + 1e-9))
    plan.warnings.push_back(
        {"UNDERDAMPED", field,
         join("has a damping of ", mesh.damping, " kg/s, a ratio of ", ratio,
              " of the stiffest mode: at the substep asked for, ", *asked,
              " s, connections that switch between taut and slack may gain energy from nothing. "
              "Give damping_kg_per_s ",
              enough, " or damping_ratio ", kSafeDampingRatio, ", or a substep of ", safe, " s")});
  else if (!asked && safe < scene.solver.safety * stable.linear_bound)
    plan.warnings.push_back(
        {"UNDERDAMPED", field,
         join("has a damping of ", mesh.damping, " kg/s, a ratio of ", ratio,
              " of the stiffest mode", kWhy, ". So it takes ",
              scene.solver.safety * stable.linear_bound / safe,
              " times the substeps; damping_kg_per_s ", enough, " or damping_ratio ",
              kSafeDampingRatio, " would need none of that")});
}

void warn_of_body(std::size_t index, const Body& body, Plan& plan) {
  const std::string field = join("colliders[", index, "].mesh");
  for (const std::string& note : body.notes) plan.warnings.push_back({"BODY_MENDED", field, note});
  constexpr double kFewCells = 2;
  if (body.thickness < kFewCells * body.grid.cell)
    plan.warnings.push_back(
        {"BODY_THIN", field,
         join("at triangle ", body.thinnest, " it is ", body.thickness,
              " m thick, less than two of its cells of ", body.grid.cell,
              " m: so thin a part holds cloth only from its edges, or not at all. Give a smaller "
              "cell_m")});
}

// Particles are kept out, and what fits between them is not met.
void warn_of_thin_colliders(const Scene& scene, Plan& plan) {
  const double across_cell = std::sqrt(2.0);
  for (std::size_t c = 0; c < scene.colliders.size(); ++c) {
    const auto* sphere = std::get_if<Sphere>(&scene.colliders[c].shape);
    const auto* capsule = std::get_if<Capsule>(&scene.colliders[c].shape);
    if (sphere == nullptr && capsule == nullptr) continue;
    const double radius = sphere != nullptr ? sphere->radius : capsule->radius;
    for (const SheetDefinition& sheet : scene.sheets) {
      const double width = 2 * (radius + sheet.skin_or_default());
      const double gap = sheet.spacing() * (sphere != nullptr ? across_cell : 1);
      if (width >= gap) continue;
      plan.warnings.push_back(
          {"COLLIDER_THIN", join("colliders[", c, sphere != nullptr ? "].sphere" : "].capsule"),
           join("is ", width, " m wide with the skin of sheet \"", sheet.name,
                "\", whose particles are ", sheet.spacing(),
                " m apart: it may pass between them. A finer mesh or a larger skin_m helps")});
    }
  }
}

// "; 30 in panel front, 15 in panel sleeve", of those on a seam in the first.
std::string count_by_panel(const SheetShape& shape, std::vector<bool> particles) {
  const auto* mesh = std::get_if<Triangles>(&shape);
  if (mesh == nullptr || (*mesh)->panels.size() < 2) return {};
  std::string text;
  auto triangle = (*mesh)->triangles.begin();
  for (const Panel& panel : (*mesh)->panels) {
    int count = 0;
    for (const auto end = triangle + panel.triangles; triangle != end; ++triangle)
      for (const int i : *triangle) {
        count += particles[static_cast<std::size_t>(i)] ? 1 : 0;
        particles[static_cast<std::size_t>(i)] = false;
      }
    if (count > 0) text += join(text.empty() ? "; " : ", ", count, " in panel ", panel.name);
  }
  return text;
}

void warn_of_start_inside(const Scene& scene, const std::vector<PlannedSheet>& planned,
                          Plan& plan) {
  std::vector<Matrix3Xd> starts;
  if (!scene.colliders.empty())
    for (const SheetDefinition& sheet : scene.sheets) starts.push_back(start_positions(sheet));
  for (std::size_t c = 0; c < scene.colliders.size(); ++c) {
    const Contacts contacts(std::span(&scene.colliders[c], 1), {}, 0, 0, 0, 0);
    for (std::size_t s = 0; s < starts.size(); ++s) {
      std::vector<bool> inside;
      for (Eigen::Index i = 0; i < starts[s].cols(); ++i)
        inside.push_back(planned[s].inverse_mass[i] != 0 && contacts.gap(starts[s].col(i)) < 0);
      const auto first = std::ranges::find(inside, true);
      if (first != inside.end())
        plan.warnings.push_back(
            {"STARTS_INSIDE", join("colliders[", c, "]"),
             join(std::ranges::count(inside, true), " particles of sheet \"", scene.sheets[s].name,
                  "\" start inside, the first of them ",
                  shown_particle(scene.sheets[s].shape, static_cast<int>(first - inside.begin())),
                  count_by_panel(scene.sheets[s].shape, inside), ": they are pushed out at ",
                  Contacts::kOutward, " m/s")});
    }
  }
}

void warn(const Scene& scene, const std::vector<PlannedSheet>& planned,
          const std::vector<StableStep>& steps, Plan& plan) {
  if (!scene.cloth_contact)
    plan.warnings.push_back({"NO_SELF_COLLISION", "", "a sheet may pass through itself"});
  if (!scene.cloth_contact && scene.sheets.size() > 1)
    plan.warnings.push_back(
        {"NO_SHEET_SHEET_COLLISION", "sheets", "sheets may pass through each other"});
  for (std::size_t c = 0; c < scene.colliders.size(); ++c)
    if (std::holds_alternative<Box>(scene.colliders[c].shape) && !scene.cloth_contact)
      plan.warnings.push_back(
          {"BOX_EDGES", "colliders[" + std::to_string(c) + "].box",
           "without cloth_contact only particles are kept out: an edge of the box may cut through "
           "the cells between them, and cells that are pulled over an edge may stay hooked on it, "
           "stretched by half for good. A finer grid, a larger skin_m or a capsule along the edge "
           "helps"});
  for (std::size_t c = 0; c < scene.colliders.size(); ++c)
    if (const auto* body = std::get_if<SharedBody>(&scene.colliders[c].shape))
      warn_of_body(c, **body, plan);
  warn_of_thin_colliders(scene, plan);
  warn_of_start_inside(scene, planned, plan);
  for (std::size_t s = 0; s < planned.size(); ++s) {
    if (std::holds_alternative<Triangles>(scene.sheets[s].shape)) {
      warn_of_triangles(scene, s, planned[s], steps[s].limiting_particle, plan);
    } else {
      warn_of_bending(scene, s, planned[s].mesh, plan);
      warn_of_tension(scene.sheets[s], s, plan);
    }
    warn_of_damping(scene, planned, s, steps[s], plan);
    describe_stretch(scene, s, plan);
  }
  if (plan.step.substep > plan.step.longest())
    plan.warnings.push_back(
        {"STEP_UNSTABLE", "solver.substep_s",
         join("the substep of ", plan.step.substep, " s lies above the linear bound of ",
              plan.step.longest(), " s: the run may diverge")});
}

}  // namespace

std::span<const std::string_view> warning_codes() {
  static constexpr std::string_view kCodes[] = {"BENDING_TOO_UNEQUAL",
                                                "BODY_MENDED",
                                                "BODY_THIN",
                                                "BOX_EDGES",
                                                "CLAMP_RULES",
                                                "COLLIDER_THIN",
                                                "COMPRESSION_SOFTENS",
                                                "MESH_DEPENDENT",
                                                "MESH_TOO_COARSE",
                                                "MESH_TOO_FINE",
                                                "NO_SELF_COLLISION",
                                                "NO_SHEET_SHEET_COLLISION",
                                                "SHEAR_STIFFENS_TENSION",
                                                "SLIVER",
                                                "STARTS_INSIDE",
                                                "STEP_UNSTABLE",
                                                "STRETCH_CAPPED",
                                                "TANGLED_START",
                                                "TETHERS_IDLE",
                                                "TETHERS_STIFFEN",
                                                "TETHERS_STRAIGHT",
                                                "TETHERS_TAUT",
                                                "UNDERDAMPED"};
  return kCodes;
}

int StepPlan::slow_in(std::int64_t k) const {
  const std::int64_t groups = (substeps + slow_every - 1) / slow_every;
  const auto begin = [&](std::int64_t group) { return (group * substeps + groups - 1) / groups; };
  const std::int64_t group = k * groups / substeps;
  return k == begin(group) ? static_cast<int>(begin(group + 1) - k) : 0;
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

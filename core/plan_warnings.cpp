#include "core/plan_warnings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "core/contact/contact.h"
#include "core/model/self_weight.h"
#include "core/model/text.h"
#include "core/sheet_factory.h"
#include "core/triangles/warnings.h"

namespace weft {
namespace {

std::string sheet_path(std::size_t index) { return "sheets[" + std::to_string(index) + "]"; }

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
  const double safe = borne_share(scene.solver, stable) * stable.linear_bound;
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

}  // namespace

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

}  // namespace weft

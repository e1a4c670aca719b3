#include <cmath>
#include <set>

#include "core/model/actions.h"
#include "core/model/mesh_problems.h"
#include "core/model/scene.h"
#include "core/model/text.h"

namespace weft {
namespace {

std::string at(const std::string& field, std::size_t index) {
  return field + "[" + std::to_string(index) + "]";
}

// Collects problems; every bound is stated where it is checked.
class Check {
 public:
  // Beyond this many the list says no more than it already does.
  static constexpr std::size_t kMost = 1000;

  void problem(const std::string& field, const std::string& message) {
    if (problems_.size() < kMost) problems_.push_back({field, message});
  }

  std::size_t count() const { return problems_.size(); }

  // False, and a problem, unless the value is a number from `low` to `high`.
  bool number(const std::string& field, double value, double low, double high, const char* unit) {
    if (value >= low && value <= high) return true;  // false for NaN
    const std::string suffix = *unit == '\0' ? "" : std::string(" ") + unit;
    problem(field,
            exact(value) + suffix + " is not within " + exact(low) + " to " + exact(high) + suffix);
    return false;
  }

  void vector(const std::string& field, const Vector3d& value, double most, const char* unit) {
    number(field + ".x", value.x(), -most, most, unit);
    number(field + ".y", value.y(), -most, most, unit);
    number(field + ".z", value.z(), -most, most, unit);
  }

  void position(const std::string& field, const Vector3d& value) { vector(field, value, 1e4, "m"); }

  void rotation(const std::string& field, const Quaterniond& q) {
    constexpr double kMostPart = 1e6;
    bool good = number(field + ".w", q.w(), -kMostPart, kMostPart, "");
    good &= number(field + ".x", q.x(), -kMostPart, kMostPart, "");
    good &= number(field + ".y", q.y(), -kMostPart, kMostPart, "");
    good &= number(field + ".z", q.z(), -kMostPart, kMostPart, "");
    if (good && q.norm() < 1e-9)
      problem(field, "has length " + exact(q.norm()) + "; must not be 0");
  }

  void path(const std::string& field, const Path& path) {
    for (std::size_t k = 0; k < path.size(); ++k) {
      const std::string key = at(field, k);
      const bool good = number(key + ".time_s", path[k].time, 0, 1e6, "s");
      if (good && k > 0 && path[k].time <= path[k - 1].time)
        problem(key + ".time_s", exact(path[k].time) +
                                     " s does not come after the keyframe before it, " +
                                     exact(path[k - 1].time) + " s");
      vector(key + ".offset_m", path[k].offset, kMostOffset, "m");
    }
  }

  // Of a collider whose path is sound.
  void speed(const std::string& field, const Path& path) {
    constexpr double kRounding = 1e-9;
    for (std::size_t k = 1; k < path.size(); ++k) {
      const double way = (path[k].offset - path[k - 1].offset).norm();
      const double time = path[k].time - path[k - 1].time;
      if (time > 0 && way > (1 + kRounding) * kMostColliderSpeed * time)
        problem(at(field, k) + ".offset_m",
                "moves " + exact(way) + " m in " + exact(time) + " s, " + exact(way / time) +
                    " m/s; colliders move at most " + exact(kMostColliderSpeed) + " m/s");
    }
  }

  // Names identify sheets and colliders.
  void name(const std::string& field, const std::string& name, std::set<std::string>& taken) {
    bool good = !name.empty() && name.size() <= 63;
    for (const char c : name)
      good &= (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
    if (!good)
      problem(field,
              "\"" + name.substr(0, 80) + "\" is not 1 to 63 characters of a-z, 0-9, - and _");
    else if (!taken.insert(name).second)
      problem(field, "\"" + name + "\" is taken");
  }

  std::vector<Problem> take() { return std::move(problems_); }

 private:
  std::vector<Problem> problems_;
};

void check_model(const MeasuredTextile& t, const std::string& field, Check& check) {
  const std::string f = field + ".measured.";
  check.number(f + "areal_density_kg_per_m2", t.areal_density, 1e-4, 100, "kg/m^2");
  check.number(f + "tensile_warp_n_per_m", t.tensile_warp, 0, 1e7, "N/m");
  check.number(f + "tensile_weft_n_per_m", t.tensile_weft, 0, 1e7, "N/m");
  check.number(f + "shear_n_per_m", t.shear, 0, 1e7, "N/m");
  check.number(f + "bend_rigidity_warp_n_m", t.bend_rigidity_warp, 0, 10, "N m");
  check.number(f + "bend_rigidity_weft_n_m", t.bend_rigidity_weft, 0, 10, "N m");
  check.number(f + "air_drag_kg_per_m2_s", t.air_drag, 0, 1000, "kg/(m^2 s)");
}

void check_model(const RawTextile& t, const std::string& field, Check& check) {
  const std::string f = field + ".raw.";
  check.number(f + "particle_mass_kg", t.particle_mass, 1e-9, 1000, "kg");
  check.number(f + "stretch_n_per_m", t.stretch, 0, 1e7, "N/m");
  check.number(f + "shear_n_per_m", t.shear, 0, 1e7, "N/m");
  check.number(f + "bend_n_m2", t.bend, 0, 10, "N m^2");
  if (t.clamp) check.number(f + "clamp_n_per_m", *t.clamp, 0, 1e7, "N/m");
  check.number(f + "air_drag_kg_per_s", t.air_drag, 0, 1000, "kg/s");
}

void check_textile(const Textile& textile, const std::string& field, Check& check) {
  std::visit([&](const auto& model) { check_model(model, field, check); }, textile.model);
  if (textile.damping) check.number(field + ".damping_kg_per_s", *textile.damping, 0, 1000, "kg/s");
  if (textile.damping_ratio)
    check.number(field + ".damping_ratio", *textile.damping_ratio, 0, 1, "of critical damping");
  check.number(field + ".friction_coefficient", textile.friction, 0, 10, "");
}

void check_values(const std::string& field, const std::vector<double>& values, int particles,
                  double most, const char* unit, Check& check) {
  if (values.empty()) return;
  const std::size_t wanted = 3 * static_cast<std::size_t>(particles);
  if (values.size() != wanted)
    return check.problem(field, "has " + std::to_string(values.size()) + " values; " +
                                    std::to_string(wanted) + " (3 x particles) or none are needed");
  for (std::size_t i = 0; i < values.size(); ++i)
    check.number(at(field, i), values[i], -most, most, unit);
}

// Whether its particles can be counted.
bool check_shape(const Grid& grid, const std::string& sheet, Check& check) {
  constexpr int kMostRows = 4096;
  const std::string field = sheet + ".grid.";
  bool sized = check.number(field + "rows", grid.rows, 2, kMostRows, "");
  sized &= check.number(field + "columns", grid.columns, 2, kMostRows, "");
  const double given = grid.simulated_every > 1 ? grid.shown_spacing : grid.spacing;
  check.number(field + "spacing_m", given, 1e-5, 10, "m");
  return sized;
}

bool check_shape(const Triangles& mesh, const std::string& sheet, Check& check) {
  bool sound = true;
  for (const Problem& each : find_problems(*mesh, sheet + ".triangles.data")) {
    check.problem(each.field, each.message);
    sound = false;
  }
  return sound;
}

// One constant for every connection says nothing of a membrane, nor of two textiles.
void check_triangles(const SheetDefinition& sheet, const std::string& field, Check& check) {
  check_textile(sheet.textile, field + ".textile", check);
  const bool raw = std::holds_alternative<RawTextile>(sheet.textile.model);
  if (raw && !std::holds_alternative<ChoiKo>(sheet.bending))
    check.problem(field + ".textile.raw",
                  "needs bending.choi_ko on triangles, or give measured values");
  if (!std::get<Triangles>(sheet.shape)->folds.empty() &&
      std::holds_alternative<ChoiKo>(sheet.bending))
    check.problem(field + ".triangles.data.folds",
                  "need ISOMETRIC bending; the sheet's is CHOI_KO, which knows no angles");
  for (const PanelTextile& each : sheet.panel_textiles) {
    const auto panel = static_cast<std::size_t>(each.panel);
    const std::string path = at(field + ".triangles.data.panels", panel) + ".textile";
    check_textile(each.textile, path, check);
    if (raw || std::holds_alternative<RawTextile>(each.textile.model))
      check.problem(path, "panels differ in measured values only; the sheet's are raw, or these");
  }
}

// Each of the sheet, and in `taken` once: `how`.
void check_particles(const std::vector<int>& particles, int count, const std::string& field,
                     const char* if_none, const char* how, std::set<int>& taken, Check& check) {
  if (particles.empty()) check.problem(field, std::string("is empty; ") + if_none);
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const std::string particle = at(field, k);
    if (check.number(particle, particles[k], 0, count - 1, "") &&
        !taken.insert(particles[k]).second)
      check.problem(particle, std::to_string(particles[k]) + " is " + how + " twice");
  }
}

void check_sheet(const SheetDefinition& sheet, const std::string& field, Check& check) {
  const bool sized =
      std::visit([&](const auto& shape) { return check_shape(shape, field, check); }, sheet.shape);
  if (std::holds_alternative<Triangles>(sheet.shape))
    check_triangles(sheet, field, check);
  else
    check_textile(sheet.textile, field + ".textile", check);

  if (const auto* law = std::get_if<ChoiKo>(&sheet.bending)) {
    check.number(field + ".bending.choi_ko.segments", law->segments, 1, 65536, "");
    check.number(field + ".bending.choi_ko.degree", law->degree, 1, 24, "");
    const bool linearized = law->evaluator == Evaluator::kLinearized;
    if (law->fold_clamp && !linearized)
      check.problem(field + ".bending.choi_ko.fold_clamp",
                    "true is for the evaluator LINEARIZED only");
    if (law->optimal_breakpoints && (!linearized || law->fold_clamp))
      check.problem(field + ".bending.choi_ko.optimal_breakpoints",
                    "true is for the evaluator LINEARIZED without fold_clamp only");
  }
  check.position(field + ".placement.origin_m", sheet.origin);
  check.rotation(field + ".placement.rotation", sheet.rotation);
  if (sheet.skin) check.number(field + ".skin_m", *sheet.skin, 0, 1, "m");
  if (!sized) return;

  constexpr double kThinnest = 1e-6;
  if (sheet.thickness)
    check.number(field + ".thickness_m", *sheet.thickness, kThinnest, most_thickness(sheet), "m");
  if (sheet.tether_stretch)
    check.number(field + ".tether_stretch", *sheet.tether_stretch, 0, 1, "");
  check_values(field + ".start_positions_m", sheet.start_positions, sheet.particle_count(), 1e4,
               "m", check);
  check_values(field + ".start_velocities_m_per_s", sheet.start_velocities, sheet.particle_count(),
               1000, "m/s", check);
  std::set<int> pinned;
  for (std::size_t p = 0; p < sheet.pins.size(); ++p) {
    const std::string pin = at(field + ".pins", p);
    check_particles(sheet.pins[p].particles, sheet.particle_count(), pin + ".particles",
                    "a pin holds 1 particle or more", "pinned", pinned, check);
    check.path(pin + ".path", sheet.pins[p].path);
  }
}

void check_shape(const Plane& plane, const std::string& field, Check& check) {
  check.position(field + ".plane.point_m", plane.point);
  check.vector(field + ".plane.normal", plane.normal, 1e6, "");
  if (plane.normal.norm() < 1e-9)
    check.problem(field + ".plane.normal",
                  "has length " + exact(plane.normal.norm()) + "; must not be 0");
}

constexpr double kSmallest = 1e-6, kLargest = 1e4;  // of a body, m

void check_shape(const Sphere& sphere, const std::string& field, Check& check) {
  check.position(field + ".sphere.center_m", sphere.center);
  check.number(field + ".sphere.radius_m", sphere.radius, kSmallest, kLargest, "m");
}

void check_shape(const Box& box, const std::string& field, Check& check) {
  check.position(field + ".box.center_m", box.center);
  const std::string half = field + ".box.half_size_m.";
  check.number(half + "x", box.half_size.x(), kSmallest, kLargest, "m");
  check.number(half + "y", box.half_size.y(), kSmallest, kLargest, "m");
  check.number(half + "z", box.half_size.z(), kSmallest, kLargest, "m");
  check.rotation(field + ".box.rotation", box.rotation);
}

void check_shape(const Capsule& capsule, const std::string& field, Check& check) {
  check.position(field + ".capsule.start_m", capsule.start);
  check.position(field + ".capsule.end_m", capsule.end);
  check.number(field + ".capsule.radius_m", capsule.radius, kSmallest, kLargest, "m");
}

void check_shape(const SharedBody& body, const std::string& field, Check& check) {
  if (!body) check.problem(field + ".mesh", "is absent; give triangles");
}

// Nearer to a body than its grid reaches, distances are only bounds.
void check_reach(const Scene& scene, const Collider& collider, const std::string& field,
                 Check& check) {
  const auto* body = std::get_if<SharedBody>(&collider.shape);
  if (body == nullptr || !*body) return;
  for (const SheetDefinition& sheet : scene.sheets)
    if (const double skin = sheet.skin_or_default(); skin > (*body)->grid.reach)
      check.problem(field + ".mesh", "keeps distances up to " + exact((*body)->grid.reach) +
                                         " m; sheet \"" + sheet.name + "\" has a skin_m of " +
                                         exact(skin) + " m");
}

// Between poses distances are known near the surface only, not deep below it.
void check_poses(const Scene& scene, const Collider& collider, const std::string& field,
                 Check& check) {
  if (!collider.poses || !scene.dressing || scene.dressing->deflate == 0) return;
  const double full = scene.dressing->close + scene.dressing->settle;
  const double first = collider.poses->times.front();
  if (collider.poses->times.size() > 1 && first < full)
    check.problem(field + (collider.asset.empty() ? ".mesh.data.poses.times_s[0]" : ".mesh.asset"),
                  "leaves its first pose at " + exact(first) +
                      " s; it has dressing.deflate_m to grow back by until " + exact(full) +
                      " s (close_s + settle_s), and is not to move "
                      "before");
}

// sound: of each sheet, whether it has no problem of its own.
void check_dressing(const Scene& scene, const std::vector<bool>& sound, Check& check) {
  constexpr std::size_t kMostHolds = 64;
  const Dressing& dressing = *scene.dressing;
  check.number("dressing.close_s", dressing.close, 0, 60, "s");
  check.number("dressing.settle_s", dressing.settle, 0, 60, "s");
  check.number("dressing.drag_per_s", dressing.drag, 0, 1000, "1/s");
  check.number("dressing.deflate_m", dressing.deflate, 0, 0.1, "m");
  check.number("dressing.holds", static_cast<double>(dressing.holds.size()), 0, kMostHolds,
               "elements");
  for (std::size_t h = 0; h < dressing.holds.size(); ++h) {
    const Hold& hold = dressing.holds[h];
    const std::string field = at("dressing.holds", h);
    check.number(field + ".until_s", hold.until, 0, 1000, "s");
    if (hold.sheet < 0 || static_cast<std::size_t>(hold.sheet) >= scene.sheets.size()) {
      check.problem(field + ".sheet", "the scene has no sheet " + std::to_string(hold.sheet));
      continue;
    }
    const auto index = static_cast<std::size_t>(hold.sheet);
    if (!sound[index]) continue;
    const SheetDefinition& sheet = scene.sheets[index];
    std::set<int> held;
    check_particles(hold.particles, sheet.particle_count(), field + ".particles",
                    "a hold has 1 particle or more", "held", held, check);
  }
  for (std::size_t s = 0; s < scene.sheets.size(); ++s)
    if (std::holds_alternative<Triangles>(scene.sheets[s].shape) &&
        std::holds_alternative<ChoiKo>(scene.sheets[s].bending))
      check.problem(at("sheets", s) + ".bending",
                    "is CHOI_KO; sheets of triangles that are dressed need ISOMETRIC");
}

void check_environment(const Environment& environment, Check& check) {
  check.vector("environment.gravity_m_per_s2", environment.gravity, 1000, "m/s^2");
  if (!environment.wind) return;
  const Wind& wind = *environment.wind;
  const std::string f = "environment.wind.";
  check.vector(f + "velocity_m_per_s", wind.velocity, 200, "m/s");
  check.number(f + "gust", wind.gust, 0, 1, "");
  check.number(f + "gust_period_s", wind.gust_period, 1e-3, 1e4, "s");
  check.number(f + "air_density_kg_per_m3", wind.air_density, 0, 10, "kg/m^3");
  check.number(f + "tangential_drag_kg_per_m2_s", wind.tangential_drag, 0, 1000, "kg/(m^2 s)");
}

void check_solver(const SolverSettings& solver, Check& check) {
  check.number("solver.frame_step_s", solver.frame_step, 1e-6, 10, "s");
  if (solver.substep) check.number("solver.substep_s", *solver.substep, 1e-9, 10, "s");
  check.number("solver.safety", solver.safety, 0.01, 1, "");
  check.number("solver.max_repairs", solver.max_repairs, 0, 20, "");
  check.number("solver.slow_forces_every", solver.slow_forces_every, 1, 16, "substeps");
  if (solver.max_self_weight_strain)
    check.number("solver.max_self_weight_strain", *solver.max_self_weight_strain, 1e-4, 1, "");
}

}  // namespace

std::vector<Problem> find_problems(const Scene& scene) {
  constexpr std::size_t kMostSheets = 64, kMostColliders = 256;
  Check check;
  check.number("sheets", static_cast<double>(scene.sheets.size()), 1, kMostSheets, "elements");
  check.number("colliders", static_cast<double>(scene.colliders.size()), 0, kMostColliders,
               "elements");
  std::set<std::string> sheet_names, collider_names;
  std::vector<bool> sound;
  for (std::size_t s = 0; s < scene.sheets.size(); ++s) {
    const std::string field = at("sheets", s);
    check.name(field + ".name", scene.sheets[s].name, sheet_names);
    const std::size_t before = check.count();
    check_sheet(scene.sheets[s], field, check);
    sound.push_back(before < Check::kMost && check.count() == before);
  }
  for (std::size_t c = 0; c < scene.colliders.size(); ++c) {
    const Collider& collider = scene.colliders[c];
    const std::string field = at("colliders", c);
    check.name(field + ".name", collider.name, collider_names);
    std::visit([&](const auto& shape) { check_shape(shape, field, check); }, collider.shape);
    check_reach(scene, collider, field, check);
    check_poses(scene, collider, field, check);
    check.number(field + ".friction_coefficient", collider.friction, 0, 10, "");
    check.path(field + ".path", collider.path);
    check.speed(field + ".path", collider.path);
  }
  if (scene.dressing) check_dressing(scene, sound, check);
  if (scene.untangle) {
    check.number("untangle_s", *scene.untangle, 0, 1000, "s");
    if (!scene.cloth_contact) check.problem("cloth_contact", "is false; untangle_s needs it");
  }
  check_environment(scene.environment, check);
  check_solver(scene.solver, check);
  return check.take();
}

std::vector<Problem> find_problems(const Action& action, const std::string& field) {
  Check check;
  if (action.kind == Action::Kind::kDrag) check.position(field + ".target_m", action.target);
  if (action.kind == Action::Kind::kMoveCollider)
    check.position(field + ".offset_m", action.target);
  if (action.kind == Action::Kind::kPoseCollider)
    check.number(field + ".speed_m_per_s", action.pose_speed, 0.01, kMostSpeed, "m/s");
  if (action.duration) check.number(field + ".duration_s", *action.duration, 1e-6, 1e4, "s");
  return check.take();
}

std::vector<Problem> find_problems(const Textile& textile, const std::string& field) {
  Check check;
  check_textile(textile, field, check);
  return check.take();
}

}  // namespace weft

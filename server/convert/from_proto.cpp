#include <google/protobuf/util/field_mask_util.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>

#include "core/model/text.h"
#include "server/convert/convert.h"
#include "server/convert/mesh.h"
#include "server/textiles/catalogue.h"

namespace weft {
namespace {

using google::protobuf::RepeatedPtrField;
using google::protobuf::util::FieldMaskUtil;

// Values by their number in the interface; 0 is the default.
constexpr std::array kEvaluators = {Evaluator::kLinearized, Evaluator::kSeries, Evaluator::kExact,
                                    Evaluator::kLinearized, Evaluator::kPolynomial};
constexpr std::array kIntegrators = {IntegratorKind::kVerlet, IntegratorKind::kVerlet,
                                     IntegratorKind::kEuler,  IntegratorKind::kMidpoint,
                                     IntegratorKind::kRk4,    IntegratorKind::kLaggedVerlet};
constexpr std::array kLabTests = {LabTest::kTensile, LabTest::kTensile,    LabTest::kShear,
                                  LabTest::kBending, LabTest::kCantilever, LabTest::kChain,
                                  LabTest::kDrape};
constexpr std::array<std::optional<Cut>, 6> kLabMeshes = {
    std::nullopt, std::nullopt, Cut::kRight, Cut::kAlternating, Cut::kEquilateral, Cut::kIrregular};
constexpr std::array kAccuracies = {Accuracy::kStandard, Accuracy::kDraft, Accuracy::kStandard,
                                    Accuracy::kFine};
constexpr std::array kPrecisions = {Precision::kSingle, Precision::kSingle, Precision::kDouble};
constexpr std::array kStepBounds = {StepBound::kEveryShape, StepBound::kEveryShape,
                                    StepBound::kUnsheared};

std::string at(const std::string& field, int index) {
  return field + "[" + std::to_string(index) + "]";
}

// Vectors that are absent are 0 where the interface states no other default.
Vector3d vector(const v1::Vector3& v) { return {v.x(), v.y(), v.z()}; }

template <class Message>
Quaterniond rotation(const Message& message) {
  if (!message.has_rotation()) return Quaterniond::Identity();
  const auto& r = message.rotation();
  return {r.w(), r.x(), r.y(), r.z()};
}

// "sheet", "sheet-2" ... by position, or the next one that is free.
template <class Message>
std::vector<std::string> names(const std::string& stem, const RepeatedPtrField<Message>& messages) {
  std::set<std::string> taken;
  for (const auto& message : messages) taken.insert(message.name());
  std::vector<std::string> result;
  for (const auto& message : messages) {
    std::string name = message.name();
    for (std::size_t n = result.size() + 1; name.empty(); ++n) {
      const std::string free = n == 1 ? stem : stem + "-" + std::to_string(n);
      if (taken.insert(free).second) name = free;
    }
    result.push_back(std::move(name));
  }
  return result;
}

// Reads messages, and collects what cannot be said in core's words. Paths are relative to the
// scene.
class Reader {
 public:
  explicit Reader(const FindMesh& find_mesh = {}, Scheduler* scheduler = nullptr)
      : find_mesh_(find_mesh), scheduler_(scheduler) {}

  Scene scene(const v1::Scene& from);
  Textile textile(const v1::Textile& from, const std::string& field);
  LabOrder lab_order(const v1::RunTestRequest& from);

  // What was found here, then core's problems, but none with a value that stands in for a missing
  // one.
  std::vector<Problem> with(const std::vector<Problem>& problems) &&;

 private:
  void problem(const std::string& field, const std::string& message) {
    problems_.push_back({field, message});
  }
  void missing(const std::string& field, const std::string& choices, const std::string& stand_in) {
    problem(field, "is absent; give " + choices);
    stand_ins_.push_back(stand_in);
  }

  template <class Enum, std::size_t N>
  Enum choice(const std::array<Enum, N>& values, int number, const std::string& field) {
    if (number >= 0 && number < static_cast<int>(N))
      return values[static_cast<std::size_t>(number)];
    problem(field, std::to_string(number) + " is not within 0 to " + std::to_string(N - 1));
    return values[0];
  }

  SheetDefinition sheet(const v1::Sheet& from, const std::string& field);
  Grid grid(const v1::Grid& from, const std::string& field);
  void simulate(const SheetShape& shape, const std::string& field, const char* how,
                std::set<int>& taken, std::vector<int>& particles);
  template <class Values>
  std::vector<double> start_values(const Values& from, const std::string& field, double most,
                                   const char* unit, const SheetShape& shape);
  void set_shape(const v1::Sheet& from, const std::string& field, SheetDefinition& sheet);
  BendingLaw bending(const v1::BendingLaw& from, const std::string& field);
  MeasuredTextile preset(const std::string& name, const std::string& field);
  Collider collider(const v1::Collider& from, const std::string& field);
  Dressing dressing(const v1::Dressing& from, const std::vector<SheetDefinition>& sheets);
  Environment environment(const v1::Environment& from);
  SolverSettings solver(const v1::SolverSettings& from, bool dressed);

  template <class Source>
  std::shared_ptr<const v1::MeshData> mesh(const Source& from, const std::string& field);
  void set_body(const v1::BodyMesh& from, const std::string& field, Collider& collider);

  const FindMesh& find_mesh_;
  Scheduler* const scheduler_;  // or nullptr
  Accuracy accuracy_ = Accuracy::kStandard;
  double largest_skin_ = 0;  // of the sheets, m
  std::vector<Problem> problems_;
  std::vector<std::string> stand_ins_;  // beginnings of paths
};

Scene Reader::scene(const v1::Scene& from) {
  Scene scene;
  accuracy_ = choice(kAccuracies, from.solver().accuracy(), "solver.accuracy");
  const auto sheet_names = names("sheet", from.sheets());
  for (int i = 0; i < from.sheets_size(); ++i) {
    scene.sheets.push_back(sheet(from.sheets(i), at("sheets", i)));
    scene.sheets.back().name = sheet_names[static_cast<std::size_t>(i)];
    if (const double skin = scene.sheets.back().skin_or_default();
        skin <= 1)  // larger ones are refused
      largest_skin_ = std::max(largest_skin_, skin);
  }
  const auto collider_names = names("collider", from.colliders());
  for (int i = 0; i < from.colliders_size(); ++i) {
    scene.colliders.push_back(collider(from.colliders(i), at("colliders", i)));
    scene.colliders.back().name = collider_names[static_cast<std::size_t>(i)];
  }
  scene.cloth_contact = from.cloth_contact();
  if (from.has_untangle_s()) scene.untangle = from.untangle_s();
  if (from.has_dressing()) scene.dressing = dressing(from.dressing(), scene.sheets);
  scene.environment = environment(from.environment());
  scene.solver = solver(from.solver(), from.has_dressing());
  return scene;
}

SheetDefinition Reader::sheet(const v1::Sheet& from, const std::string& field) {
  SheetDefinition sheet;
  set_shape(from, field, sheet);
  if (from.has_textile()) {
    sheet.textile = textile(from.textile(), field + ".textile");
  } else {
    missing(field + ".textile", "a textile", field + ".textile.");
  }
  sheet.bending = from.has_bending()     ? bending(from.bending(), field + ".bending")
                  : from.has_triangles() ? Isometric{}
                                         : default_bending(accuracy_);
  sheet.origin = vector(from.placement().origin_m());
  sheet.rotation = rotation(from.placement());
  sheet.start_positions =
      start_values(from.start_positions_m(), field + ".start_positions_m", 1e4, "m", sheet.shape);
  sheet.start_velocities =
      start_values(from.start_velocities_m_per_s(), field + ".start_velocities_m_per_s", 1000,
                   "m/s", sheet.shape);
  std::set<int> pinned;
  for (int p = 0; p < from.pins_size(); ++p) {
    sheet.pins.push_back(to_pin(from.pins(p)));
    simulate(sheet.shape, at(field + ".pins", p) + ".particles", "pinned", pinned,
             sheet.pins.back().particles);
  }
  if (from.has_skin_m()) sheet.skin = from.skin_m();
  if (from.has_thickness_m()) sheet.thickness = from.thickness_m();
  if (from.has_tether_stretch()) sheet.tether_stretch = from.tether_stretch();
  return sheet;
}

void Reader::set_shape(const v1::Sheet& from, const std::string& field, SheetDefinition& sheet) {
  sheet.shape = grid(from.grid(), field + ".grid");
  if (from.has_grid()) return;
  if (!from.has_triangles()) return missing(field + ".mesh", "grid or triangles", field + ".grid.");
  // a grid stands in for what is faulty
  for (const char* each : {".grid.", ".start_", ".pins", ".bending", ".textile.raw"})
    stand_ins_.push_back(field + each);
  const auto data = mesh(from.triangles(), field + ".triangles");
  if (!data) return;
  const std::string path =
      field + (from.triangles().has_data() ? ".triangles.data" : ".triangles.asset");
  auto made = to_mesh(*data, path);
  if (auto* problems = std::get_if<std::vector<Problem>>(&made)) {
    std::move(problems->begin(), problems->end(), std::back_inserter(problems_));
    return;
  }
  stand_ins_.resize(stand_ins_.size() - 5);
  sheet.shape = std::get<Triangles>(std::move(made));
  if (from.triangles().has_asset()) sheet.asset = from.triangles().asset();
  for (int p = 0; p < data->panels_size(); ++p)
    if (data->panels(p).has_textile())
      sheet.panel_textiles.push_back(
          {p, textile(data->panels(p).textile(), at(path + ".panels", p) + ".textile")});
}

Grid Reader::grid(const v1::Grid& from, const std::string& field) {
  constexpr int kMostEvery = 64, kMostRows = 4096;
  const Grid all{from.rows(), from.columns(), from.spacing_m()};
  const int every = from.has_simulated_every() ? from.simulated_every() : 1;
  if (every < 1 || every > kMostEvery)
    problem(field + ".simulated_every", join(every, " is not within 1 to ", kMostEvery));
  const auto [least, most] = std::minmax(all.rows, all.columns);
  if (every <= 1 || every > kMostEvery || least < 2 || most > kMostRows) return all;
  const auto divides = [&](int cells, const char* side) {
    if (cells % every == 0) return true;
    problem(field + ".simulated_every",
            join("is ", every, ", of which ", side, " - 1 = ", cells, " is no multiple"));
    return false;
  };
  const int rows = all.rows - 1, columns = all.columns - 1;
  if (!divides(rows, "rows") || !divides(columns, "columns")) return all;
  return {rows / every + 1, columns / every + 1, every * all.spacing, every, all.spacing};
}

// Leaves those that are simulated, with their indices among these. how: "pinned"; taken: those
// that are already.
void Reader::simulate(const SheetShape& shape, const std::string& field, const char* how,
                      std::set<int>& taken, std::vector<int>& particles) {
  if (!is_interpolated(shape) || particles.empty()) return;
  const int last = particle_count(shown(shape)) - 1;
  std::vector<int> kept;
  bool sound = true;
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const bool within = particles[k] >= 0 && particles[k] <= last;
    if (within && taken.insert(particles[k]).second) {
      if (const auto simulated = simulated_particle(shape, particles[k]))
        kept.push_back(*simulated);
      continue;
    }
    problem(at(field, static_cast<int>(k)), within
                                                ? join(particles[k], " is ", how, " twice")
                                                : join(particles[k], " is not within 0 to ", last));
    sound = false;
  }
  if (sound && kept.empty())
    problem(field, join("has none that is simulated: those in each row and column number ",
                        std::get<Grid>(shape).simulated_every, " from the first on are"));
  if (kept.empty()) stand_ins_.push_back(field);
  particles = std::move(kept);
}

// Three of each particle that is simulated.
template <class Values>
std::vector<double> Reader::start_values(const Values& from, const std::string& field, double most,
                                         const char* unit, const SheetShape& shape) {
  std::vector<double> values(from.begin(), from.end());
  if (!is_interpolated(shape) || values.empty()) return values;
  const auto all = 3 * static_cast<std::size_t>(particle_count(shown(shape)));
  if (values.size() != all) {
    problem(field,
            join("has ", values.size(), " values; ", all, " (3 x particles) or none are needed"));
    return {};
  }
  for (std::size_t i = 0; i < all; ++i) {
    if (std::abs(values[i]) <= most) continue;
    problem(at(field, static_cast<int>(i)),
            join(values[i], " ", unit, " is not within ", -most, " to ", most, " ", unit));
    return {};
  }
  std::vector<double> kept;
  for (int i = 0; i < particle_count(shape); ++i) {
    const auto first = values.begin() + 3 * shown_particle(shape, i);
    kept.insert(kept.end(), first, first + 3);
  }
  return kept;
}

// nullptr where there is none, which is said.
template <class Source>
std::shared_ptr<const v1::MeshData> Reader::mesh(const Source& from, const std::string& field) {
  switch (from.source_case()) {
    case Source::kData:
      return {std::shared_ptr<const void>(), &from.data()};  // the scene's own, which stays
    case Source::kAsset: {
      auto found = find_mesh_ ? find_mesh_(from.asset()) : nullptr;
      if (!found)
        problem(
            field + ".asset",
            "\"" + from.asset() + "\" is no asset of yours that is whole; UploadAsset makes one");
      return found;
    }
    case Source::SOURCE_NOT_SET:
      problem(field + ".source", "is absent; give data or asset");
      return nullptr;
  }
  return nullptr;
}

BendingLaw Reader::bending(const v1::BendingLaw& from, const std::string& field) {
  if (from.has_isometric()) {
    Isometric isometric;
    if (from.isometric().has_resist_compression())
      isometric.resist_compression = from.isometric().resist_compression();
    return isometric;
  }
  if (!from.has_choi_ko()) missing(field + ".law", "choi_ko or isometric", field + ".choi_ko.");
  const auto& law = from.choi_ko();
  ChoiKo choi_ko;
  choi_ko.evaluator = choice(kEvaluators, law.evaluator(), field + ".choi_ko.evaluator");
  if (law.has_segments()) choi_ko.segments = law.segments();
  if (law.has_degree()) choi_ko.degree = law.degree();
  choi_ko.fold_clamp = law.fold_clamp();
  if (law.has_diagonal_bend()) choi_ko.diagonal_bend = law.diagonal_bend();
  choi_ko.optimal_breakpoints = law.optimal_breakpoints();
  return choi_ko;
}

Textile Reader::textile(const v1::Textile& from, const std::string& field) {
  Textile textile;
  if (from.has_damping_kg_per_s()) textile.damping = from.damping_kg_per_s();
  if (from.has_damping_ratio()) textile.damping_ratio = from.damping_ratio();
  if (from.has_friction_coefficient()) textile.friction = from.friction_coefficient();
  switch (from.model_case()) {
    case v1::Textile::kPreset:
      textile.model = preset(from.preset(), field);
      break;
    case v1::Textile::kMeasured: {
      const auto& m = from.measured();
      textile.model = MeasuredTextile{.areal_density = m.areal_density_kg_per_m2(),
                                      .tensile_warp = m.tensile_warp_n_per_m(),
                                      .tensile_weft = m.tensile_weft_n_per_m(),
                                      .shear = m.shear_n_per_m(),
                                      .bend_rigidity_warp = m.bend_rigidity_warp_n_m(),
                                      .bend_rigidity_weft = m.bend_rigidity_weft_n_m(),
                                      .air_drag = m.air_drag_kg_per_m2_s()};
      break;
    }
    case v1::Textile::kRaw: {
      const auto& r = from.raw();
      RawTextile raw{.particle_mass = r.particle_mass_kg(),
                     .stretch = r.stretch_n_per_m(),
                     .shear = r.shear_n_per_m(),
                     .bend = r.bend_n_m2(),
                     .clamp = {},
                     .air_drag = r.air_drag_kg_per_s()};
      if (r.has_clamp_n_per_m()) raw.clamp = r.clamp_n_per_m();
      textile.model = raw;
      break;
    }
    case v1::Textile::MODEL_NOT_SET:
      missing(field + ".model", "preset, measured or raw", field + ".measured.");
      break;
  }
  return textile;
}

MeasuredTextile Reader::preset(const std::string& name, const std::string& field) {
  const v1::TextilePreset* preset = find_preset(name);
  if (preset != nullptr && preset->missing().empty()) {
    v1::Textile values;
    *values.mutable_measured() = preset->values();
    return std::get<MeasuredTextile>(textile(values, field).model);
  }
  if (preset == nullptr) {
    problem(field + ".preset",
            "there is no preset \"" + name + "\"; ListTextiles (weft textile list) names them all");
  } else {
    std::string lacking;
    for (const auto& value : preset->missing()) lacking += (lacking.empty() ? "" : ", ") + value;
    problem(field + ".preset", "preset \"" + name + "\" is incomplete: no source gives " + lacking +
                                   "; take another, or give all values in measured");
  }
  stand_ins_.push_back(field + ".measured.");
  return {};
}

Collider Reader::collider(const v1::Collider& from, const std::string& field) {
  Collider collider;
  switch (from.shape_case()) {
    case v1::Collider::kPlane: {
      Plane plane{.point = vector(from.plane().point_m())};
      if (from.plane().has_normal()) plane.normal = vector(from.plane().normal());
      collider.shape = plane;
      break;
    }
    case v1::Collider::kSphere:
      collider.shape = Sphere{vector(from.sphere().center_m()), from.sphere().radius_m()};
      break;
    case v1::Collider::kBox: {
      const auto& box = from.box();
      collider.shape = Box{vector(box.center_m()), vector(box.half_size_m()), rotation(box)};
      if (!box.has_half_size_m()) {
        missing(field + ".box.half_size_m", "half of each edge", field + ".box.half_size_m.");
      }
      break;
    }
    case v1::Collider::kCapsule:
      collider.shape = Capsule{vector(from.capsule().start_m()), vector(from.capsule().end_m()),
                               from.capsule().radius_m()};
      break;
    case v1::Collider::kMesh:
      set_body(from.mesh(), field, collider);
      break;
    case v1::Collider::SHAPE_NOT_SET:
      problem(field + ".shape", "is absent; give plane, sphere, box, capsule or mesh");
      break;
  }
  if (from.has_friction_coefficient()) collider.friction = from.friction_coefficient();
  collider.path = to_path(from.path());
  return collider;
}

void Reader::set_body(const v1::BodyMesh& from, const std::string& field, Collider& collider) {
  constexpr double kLeast = 1e-6, kMost = 1e4;  // m
  const std::string path = field + (from.has_data() ? ".mesh.data" : ".mesh.asset");
  if (from.has_cell_m()) collider.cell = from.cell_m();
  // a plane stands in for what is faulty
  if (collider.cell && !(*collider.cell >= kLeast && *collider.cell <= kMost))
    return problem(field + ".mesh.cell_m",
                   join(*collider.cell, " m is not within ", kLeast, " to ", kMost, " m"));
  const auto data = mesh(from, field + ".mesh");
  if (!data) return;
  // in steps, for scenes to share bodies
  const double reach = std::exp2(std::ceil(std::log2(std::max(largest_skin_, 1e-3))));
  auto made = to_body(*data, collider.cell, reach, path, scheduler_);
  if (auto* problems = std::get_if<std::vector<Problem>>(&made)) {
    std::move(problems->begin(), problems->end(), std::back_inserter(problems_));
  } else {
    auto& [body, poses] = std::get<ConvertedBody>(made);
    collider.shape = std::move(body);
    collider.poses = std::move(poses);
  }
  if (from.has_asset()) collider.asset = from.asset();
}

Dressing Reader::dressing(const v1::Dressing& from, const std::vector<SheetDefinition>& sheets) {
  Dressing dressing;
  if (from.has_close_s()) dressing.close = from.close_s();
  if (from.has_settle_s()) dressing.settle = from.settle_s();
  if (from.has_drag_per_s()) dressing.drag = from.drag_per_s();
  dressing.deflate = from.deflate_m();
  for (int h = 0; h < from.holds_size(); ++h) {
    const v1::Hold& given = from.holds(h);
    const std::string field = at("dressing.holds", h) + ".sheet";
    Hold& hold = dressing.holds.emplace_back();
    hold.particles.assign(given.particles().begin(), given.particles().end());
    if (given.has_until_s()) hold.until = given.until_s();
    const auto named = std::find_if(sheets.begin(), sheets.end(), [&](const SheetDefinition& each) {
      return each.name == given.sheet();
    });
    if (named != sheets.end()) {
      hold.sheet = static_cast<int>(named - sheets.begin());
      std::set<int> held;
      simulate(named->shape, at("dressing.holds", h) + ".particles", "held", held, hold.particles);
    } else if (!given.sheet().empty() || sheets.size() != 1) {
      problem(field, given.sheet().empty() ? "is absent, and the scene has " +
                                                 std::to_string(sheets.size()) + " sheets"
                                           : "the scene has no sheet \"" + given.sheet() + "\"");
      stand_ins_.push_back(field);
    }
  }
  return dressing;
}

Environment Reader::environment(const v1::Environment& from) {
  Environment environment;
  if (from.has_gravity_m_per_s2()) environment.gravity = vector(from.gravity_m_per_s2());
  if (from.has_wind()) {
    Wind& wind = environment.wind.emplace();
    wind.velocity = vector(from.wind().velocity_m_per_s());
    wind.gust = from.wind().gust();
    if (from.wind().has_gust_period_s()) wind.gust_period = from.wind().gust_period_s();
    if (from.wind().has_air_density_kg_per_m3()) {
      wind.air_density = from.wind().air_density_kg_per_m3();
    }
    wind.tangential_drag = from.wind().tangential_drag_kg_per_m2_s();
  }
  return environment;
}

SolverSettings Reader::solver(const v1::SolverSettings& from, bool dressed) {
  SolverSettings solver = default_settings(accuracy_);
  if (from.integrator() != v1::INTEGRATOR_UNSPECIFIED)
    solver.integrator = choice(kIntegrators, from.integrator(), "solver.integrator");
  if (from.step_bound() != v1::STEP_BOUND_UNSPECIFIED)
    solver.step_bound = choice(kStepBounds, from.step_bound(), "solver.step_bound");
  else if (dressed && accuracy_ == Accuracy::kStandard)
    solver.step_bound = StepBound::kUnsheared;
  if (from.precision() != v1::PRECISION_UNSPECIFIED)
    solver.precision = choice(kPrecisions, from.precision(), "solver.precision");
  if (from.has_frame_step_s()) solver.frame_step = from.frame_step_s();
  if (from.has_substep_s()) solver.substep = from.substep_s();
  solver.allow_unstable = from.allow_unstable();
  if (from.has_safety()) solver.safety = from.safety();
  if (from.has_max_repairs()) solver.max_repairs = from.max_repairs();
  if (from.has_max_self_weight_strain())
    solver.max_self_weight_strain = from.max_self_weight_strain();
  if (from.has_slow_forces_every()) solver.slow_forces_every = from.slow_forces_every();
  return solver;
}

LabOrder Reader::lab_order(const v1::RunTestRequest& from) {
  LabOrder order;
  order.test = choice(kLabTests, from.test(), "test");
  if (from.test() == v1::LAB_TEST_UNSPECIFIED) problem("test", "is absent; give one");
  if (from.has_textile()) {
    const Textile read = textile(from.textile(), "textile");
    // the rest is the order's own
    for (const auto& [field, message] : find_problems(read, "textile")) {
      if (field.starts_with("textile.damping_") || field == "textile.friction_coefficient")
        problem(field, message);
    }
    if (const auto* measured = std::get_if<MeasuredTextile>(&read.model)) {
      order.textile = *measured;
    } else {
      problem("textile.raw", "describes one mesh; a test takes preset or measured");
      stand_ins_.emplace_back("textile.");
    }
  } else {
    missing("textile", "a textile", "textile.");
  }
  order.mesh = choice(kLabMeshes, from.mesh(), "mesh");
  if (from.has_bending())
    order.bending = bending(from.bending(), "bending");
  else if (order.mesh)
    order.bending = Isometric{};
  order.weft = choice(std::array{false, false, true}, from.direction(), "direction");
  order.spacings = {from.spacings_m().begin(), from.spacings_m().end()};
  return order;
}

std::vector<Problem> Reader::with(const std::vector<Problem>& problems) && {
  std::copy_if(
      problems.begin(), problems.end(), std::back_inserter(problems_), [&](const Problem& problem) {
        return std::none_of(stand_ins_.begin(), stand_ins_.end(), [&](const std::string& begin) {
          return problem.field.starts_with(begin);
        });
      });
  return std::move(problems_);
}

// Paths of a mask that cannot be followed from `current`.
std::vector<Problem> mask_problems(const Textile& current, const v1::Textile& change,
                                   const google::protobuf::FieldMask& mask) {
  const bool raw = std::holds_alternative<RawTextile>(current.model);
  std::vector<Problem> problems;
  for (int i = 0; i < mask.paths_size(); ++i) {
    const std::string& path = mask.paths(i);
    const std::string field = at("update_mask.paths", i);
    const std::string root = path.substr(0, path.find('.'));
    const bool of_model = root == "raw" || root == "measured" || root == "preset";
    if (!FieldMaskUtil::IsValidPath<v1::Textile>(path)) {
      problems.push_back({field, "\"" + path + "\" is no field of weft.v1.Textile"});
    } else if (of_model && raw != (root == "raw")) {
      problems.push_back({field, "\"" + path + "\": the sheet has a " + (raw ? "raw" : "measured") +
                                     " textile, and a mask does not change between the two"});
    } else if (of_model && !change.GetReflection()->HasField(
                               change, change.GetDescriptor()->FindFieldByName(root))) {
      problems.push_back({"textile." + root, "is absent, but update_mask names \"" + path + "\""});
    }
  }
  return problems;
}

}  // namespace

Path to_path(const RepeatedPtrField<v1::Keyframe>& keyframes) {
  Path result;
  for (const auto& key : keyframes) result.push_back({key.time_s(), vector(key.offset_m())});
  return result;
}

Pin to_pin(const v1::Pin& pin) {
  return {{pin.particles().begin(), pin.particles().end()}, to_path(pin.path())};
}

Converted<Scene> to_scene(const v1::Scene& scene, const std::string& field,
                          const FindMesh& find_mesh, Scheduler* scheduler) {
  Reader reader(find_mesh, scheduler);
  Scene read = reader.scene(scene);
  auto problems = std::move(reader).with(find_problems(read));
  if (problems.empty()) return read;
  for (auto& problem : problems) problem.field = field + "." + problem.field;
  return problems;
}

Converted<Textile> to_textile(const v1::Textile& textile, const std::string& field) {
  Reader reader;
  const Textile read = reader.textile(textile, field);
  auto problems = std::move(reader).with(find_problems(read, field));
  if (problems.empty()) return read;
  return problems;
}

Converted<Action> to_action(const v1::Action& action, const std::string& field) {
  const auto of_particle = [](Action::Kind kind, const auto& from) {
    return Action{.kind = kind, .name = from.sheet(), .particle = from.particle()};
  };
  const auto lead = [](Action& led, const v1::Vector3& target, const auto& from) {
    led.target = vector(target);
    if (from.has_duration_s()) led.duration = from.duration_s();
  };
  const auto absent = [&](const char* what, const char* choices) {
    return std::vector<Problem>{{field + what, std::string("is absent; give ") + choices}};
  };
  switch (action.action_case()) {
    case v1::Action::kGrab:
      return of_particle(Action::Kind::kGrab, action.grab());
    case v1::Action::kDrag: {
      if (!action.drag().has_target_m()) return absent(".drag.target_m", "where it leads to");
      Action drag = of_particle(Action::Kind::kDrag, action.drag());
      lead(drag, action.drag().target_m(), action.drag());
      return drag;
    }
    case v1::Action::kRelease:
      return of_particle(Action::Kind::kRelease, action.release());
    case v1::Action::kPin:
      return of_particle(Action::Kind::kPin, action.pin());
    case v1::Action::kUnpin:
      return of_particle(Action::Kind::kUnpin, action.unpin());
    case v1::Action::kMoveCollider: {
      const auto& from = action.move_collider();
      if (!from.has_offset_m()) return absent(".move_collider.offset_m", "where it is moved to");
      Action move{.kind = Action::Kind::kMoveCollider, .name = from.collider()};
      lead(move, from.offset_m(), from);
      return move;
    }
    case v1::Action::kPoseCollider: {
      const auto& from = action.pose_collider();
      Action pose{.kind = Action::Kind::kPoseCollider,
                  .name = from.collider(),
                  .pose_time = from.pose_time_s()};
      if (from.has_speed_m_per_s()) pose.pose_speed = from.speed_m_per_s();
      return pose;
    }
    case v1::Action::kRelax:
      return Action{.kind = Action::Kind::kRelax};
    case v1::Action::ACTION_NOT_SET:
      break;
  }
  return absent("", "grab, drag, release, pin, unpin, move_collider, pose_collider or relax");
}

Converted<LabOrder> to_lab_order(const v1::RunTestRequest& request) {
  Reader reader;
  const LabOrder read = reader.lab_order(request);
  auto problems = std::move(reader).with(find_problems(read));
  if (problems.empty()) return read;
  return problems;
}

Converted<Textile> merge_textile(const Textile& current, const v1::Textile& change,
                                 const google::protobuf::FieldMask& mask) {
  if (mask.paths().empty()) return to_textile(change, "textile");
  if (auto problems = mask_problems(current, change, mask); !problems.empty()) return problems;
  v1::Textile merged = as_given(current);
  FieldMaskUtil::MergeOptions options;
  options.set_replace_message_fields(true);
  FieldMaskUtil::MergeMessageTo(change, mask, options, &merged);
  return to_textile(merged, "textile");
}

}  // namespace weft

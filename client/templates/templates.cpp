#include "client/templates/templates.h"

#include <array>
#include <cmath>
#include <numbers>

#include "client/problem.h"

namespace weft::client {
namespace {

constexpr int kMostParticles = 4096;  // along a side, as in Grid

void set(v1::Vector3* vector, double x, double y, double z) {
  vector->set_x(x);
  vector->set_y(y);
  vector->set_z(z);
}

// What the sheet of a template is without options.
struct SheetDefaults {
  int rows = 31;
  int columns = 31;
  double width = 1;       // (columns - 1) h, m
  double damping = 2e-3;  // k_d, kg/s: brings wool to rest within some seconds
  std::optional<int> segments{};
};

v1::Sheet* add_sheet(v1::Scene& scene, const SheetDefaults& defaults,
                     const TemplateOptions& options) {
  v1::Sheet* sheet = scene.add_sheets();
  sheet->set_name("sheet");
  v1::Grid* grid = sheet->mutable_grid();
  grid->set_rows(options.rows.value_or(defaults.rows));
  grid->set_columns(options.columns.value_or(defaults.columns));
  grid->set_spacing_m(options.spacing_m.value_or(defaults.width / (grid->columns() - 1)));

  sheet->mutable_textile()->set_preset("wool_tropical");
  sheet->mutable_textile()->set_damping_kg_per_s(defaults.damping);
  if (options.textile) sheet->mutable_textile()->MergeFrom(*options.textile);

  const bool linearized = !options.evaluator || *options.evaluator == v1::EVALUATOR_LINEARIZED;
  const std::optional<int> segments =
      options.segments || !linearized ? options.segments : defaults.segments;
  if (options.evaluator || segments || options.fold_clamp || options.optimal_breakpoints) {
    v1::ChoiKo* law = sheet->mutable_bending()->mutable_choi_ko();
    law->set_evaluator(options.evaluator.value_or(v1::EVALUATOR_LINEARIZED));
    if (segments) law->set_segments(*segments);
    law->set_fold_clamp(options.fold_clamp);
    law->set_optimal_breakpoints(options.optimal_breakpoints);
  }
  return sheet;
}

double width(const v1::Sheet& sheet) {
  return (sheet.grid().columns() - 1) * sheet.grid().spacing_m();
}
double depth(const v1::Sheet& sheet) {
  return (sheet.grid().rows() - 1) * sheet.grid().spacing_m();
}

// Flat and level, its centre above the origin.
void lay(v1::Sheet& sheet, double y) {
  set(sheet.mutable_placement()->mutable_origin_m(), -width(sheet) / 2, y, -depth(sheet) / 2);
}

// Upright, row 0 on top.
void stand(v1::Sheet& sheet) {
  set(sheet.mutable_placement()->mutable_origin_m(), -width(sheet) / 2, depth(sheet), 0);
  v1::Rotation* quarter = sheet.mutable_placement()->mutable_rotation();
  quarter->set_w(std::numbers::sqrt2 / 2);
  quarter->set_x(std::numbers::sqrt2 / 2);
}

void pin_corners(v1::Sheet& sheet) {
  v1::Pin* pin = sheet.add_pins();
  pin->add_particles(0);
  pin->add_particles(sheet.grid().columns() - 1);
}

void pin_columns(v1::Sheet& sheet, int count) {
  v1::Pin* pin = sheet.add_pins();
  for (int row = 0; row < sheet.grid().rows(); ++row) {
    for (int column = 0; column < count; ++column) {
      pin->add_particles(row * sheet.grid().columns() + column);
    }
  }
}

// A body on the ground, and the sheet just above it, out of the reach of its skin.
void drop(v1::Sheet& sheet, double top) { lay(sheet, top + 0.15 * sheet.grid().spacing_m()); }

void drop_on_box(v1::Scene& scene, v1::Sheet& sheet) {
  constexpr double kHeight = 0.4;
  v1::Collider* table = scene.add_colliders();
  table->set_name("table");
  set(table->mutable_box()->mutable_center_m(), 0, kHeight / 2, 0);
  set(table->mutable_box()->mutable_half_size_m(), 0.25, kHeight / 2, 0.25);
  drop(sheet, kHeight);
}

void drop_on_sphere(v1::Scene& scene, v1::Sheet& sheet) {
  constexpr double kRadius = 0.3;
  v1::Collider* ball = scene.add_colliders();
  ball->set_name("ball");
  set(ball->mutable_sphere()->mutable_center_m(), 0, kRadius, 0);
  ball->mutable_sphere()->set_radius_m(kRadius);
  drop(sheet, 2 * kRadius);
}

// For a sheet that is pulled off its body.
void add_floor(v1::Scene& scene) {
  v1::Collider* floor = scene.add_colliders();
  floor->set_name("floor");
  set(floor->mutable_plane()->mutable_normal(), 0, 1, 0);
}

v1::Scene hang(const TemplateOptions& options) {
  v1::Scene scene;
  v1::Sheet* sheet = add_sheet(scene, {}, options);
  stand(*sheet);
  pin_corners(*sheet);
  return scene;
}

v1::Scene box(const TemplateOptions& options) {
  v1::Scene scene;
  drop_on_box(scene, *add_sheet(scene, {}, options));
  add_floor(scene);
  return scene;
}

v1::Scene sphere(const TemplateOptions& options) {
  v1::Scene scene;
  drop_on_sphere(scene, *add_sheet(scene, {}, options));
  add_floor(scene);
  return scene;
}

v1::Scene flag(const TemplateOptions& options) {
  v1::Scene scene;
  v1::Sheet* sheet = add_sheet(scene, {.rows = 21, .damping = 2e-4}, options);
  stand(*sheet);
  pin_columns(*sheet, 1);
  v1::Wind* wind = scene.mutable_environment()->mutable_wind();
  set(wind->mutable_velocity_m_per_s(), 6, 0,
      1);  // not quite along the cloth, or it would lie still
  wind->set_gust(0.4);
  wind->set_gust_period_s(2);
  wind->set_tangential_drag_kg_per_m2_s(0.02);
  return scene;
}

// The edge lies midway between the two columns that are held: the curvature at the second is that
// of the half spacing on either side. 30 mm is twice the bending length of wool_tropical, where the
// cantilever test finds 41.5 degrees.
v1::Scene cantilever(const TemplateOptions& options) {
  v1::Scene scene;
  v1::Sheet* sheet =
      add_sheet(scene, {.rows = 7, .columns = 9, .width = 0.032, .damping = 2e-4}, options);
  pin_columns(*sheet, 2);
  return scene;
}

// The paper's sheet, air and time; what it leaves out is chosen here.
v1::Sheet* add_paper_sheet(v1::Scene& scene, const TemplateOptions& options,
                           std::optional<int> segments = {}) {
  v1::Sheet* sheet = add_sheet(scene, {.damping = 2e-4, .segments = segments}, options);
  if (!options.textile) {
    v1::RawTextile* textile = sheet->mutable_textile()->mutable_raw();
    textile->set_particle_mass_kg(1e-3);
    textile->set_stretch_n_per_m(2000);
    textile->set_shear_n_per_m(2000);
    textile->set_bend_n_m2(options.bend.value_or(0.1) * kPaperBend);
    textile->set_clamp_n_per_m(2000);
    textile->set_air_drag_kg_per_s(1e-3);
  }
  set(scene.mutable_environment()->mutable_gravity_m_per_s2(), 0, -9.8, 0);
  scene.mutable_solver()->set_frame_step_s(0.1);
  return sheet;
}

v1::Scene paper_1(const TemplateOptions& options) {
  v1::Scene scene;
  v1::Sheet* sheet = add_paper_sheet(scene, options);
  lay(*sheet, depth(*sheet));
  pin_corners(*sheet);
  return scene;
}

v1::Scene paper_2(const TemplateOptions& options) {
  v1::Scene scene;
  drop_on_box(scene, *add_paper_sheet(scene, options));
  return scene;
}

v1::Scene paper_3(const TemplateOptions& options) {
  v1::Scene scene;
  drop_on_sphere(scene, *add_paper_sheet(scene, options));
  return scene;
}

v1::Scene paper_4(const TemplateOptions& options) {
  v1::Scene scene;
  drop_on_sphere(scene, *add_paper_sheet(scene, options, 60));
  return scene;
}

// Moves for ever, so that a server has work: its air never rests.
v1::Scene load(const TemplateOptions& options) {
  v1::Scene scene;
  v1::Sheet* sheet = add_sheet(scene, {.damping = 2e-4}, options);
  if (!options.textile) {
    v1::RawTextile* textile = sheet->mutable_textile()->mutable_raw();
    textile->set_particle_mass_kg(1e-3);
    textile->set_stretch_n_per_m(1000);
    textile->set_shear_n_per_m(1000);
    textile->set_bend_n_m2(1e-5);
  }
  stand(*sheet);
  pin_corners(*sheet);
  v1::Wind* wind = scene.mutable_environment()->mutable_wind();
  set(wind->mutable_velocity_m_per_s(), 1, 0, 4);
  wind->set_gust(0.8);
  wind->set_gust_period_s(1.5);
  return scene;
}

struct Template {
  const char* name;
  const char* description;
  v1::Scene (*make)(const TemplateOptions&);
  bool paper = false;
};

constexpr std::array kTemplates = {
    Template{"hang", "a cloth of 1 m x 1 m hung from two corners", hang},
    Template{"box", "a cloth of 1 m x 1 m that falls on a table", box},
    Template{"sphere", "a cloth of 1 m x 1 m that falls on a ball", sphere},
    Template{"flag", "a cloth held along one side in gusts of wind", flag},
    Template{"cantilever", "a strip of 24 mm that hangs 30 mm over an edge", cantilever},
    Template{"load", "1 m x 1 m of 1 g particles that gusts keep in motion, for load tests", load},
    Template{"paper-1", "the paper's experiment 1: hung from two corners, starts level", paper_1,
             true},
    Template{"paper-2", "the paper's experiment 2: falls on a box, k_b 0 and 0.1", paper_2, true},
    Template{"paper-3", "the paper's experiment 3: falls on a sphere, k_b 0, 0.1, 0.2, 0.3",
             paper_3, true},
    Template{"paper-4", "the paper's experiment 4: falls on a sphere, 2, 5, 60 segments and exact",
             paper_4, true},
};

}  // namespace

std::vector<TemplateInfo> templates() {
  std::vector<TemplateInfo> result;
  for (const Template& entry : kTemplates) result.push_back({entry.name, entry.description});
  return result;
}

v1::Scene make_template(std::string_view name, const TemplateOptions& options) {
  std::string names;
  for (const Template& entry : kTemplates) {
    if (entry.name != name) {
      names += std::string(names.empty() ? "" : ", ") + entry.name;
      continue;
    }
    if (options.bend && (!entry.paper || options.textile)) {
      throw usage_problem("k_b in the paper's unit is for the paper's own textile only");
    }
    for (const std::optional<int>& count : {options.rows, options.columns}) {
      if (count && (*count < 2 || *count > kMostParticles)) {
        throw usage_problem("rows and columns are 2 to " + std::to_string(kMostParticles));
      }
    }
    v1::Scene scene = entry.make(options);
    if (options.accuracy) scene.mutable_solver()->set_accuracy(*options.accuracy);
    return scene;
  }
  throw usage_problem("no template \"" + std::string(name) + "\"; there are " + names);
}

}  // namespace weft::client

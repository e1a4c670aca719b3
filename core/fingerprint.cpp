#include "core/fingerprint.h"

#include <bit>
#include <random>
#include <utility>
#include <vector>

#include "core/contact/body.h"
#include "core/simulation.h"
#include "core/triangles/cut.h"

namespace weft {
namespace {

// Two panels, across the warp and along it.
SheetShape rough_mesh() {
  TriangleMesh mesh = triangle_mesh(cut_rectangle(Cut::kIrregular, 0.06, 0.03, 0.01));
  const auto triangles = static_cast<int>(mesh.triangles.size());
  mesh.panels = {{"left", triangles / 2, 1.3}, {"right", triangles - triangles / 2, 0.1}};
  return complete(std::move(mesh));
}

// Uneven, so that every kind of force acts from the first step.
SheetDefinition rough_sheet(const SheetShape& shape, const BendingLaw& bending) {
  SheetDefinition sheet;
  sheet.name = "sheet";
  sheet.shape = shape;
  sheet.textile.model = MeasuredTextile{.areal_density = 0.2,
                                        .tensile_warp = 300,
                                        .tensile_weft = 200,
                                        .shear = 30,
                                        .bend_rigidity_warp = 2e-6,
                                        .bend_rigidity_weft = 1e-6,
                                        .air_drag = 0.1};
  sheet.bending = bending;
  std::minstd_rand random;
  for (int i = 0; i < particle_count(shape); ++i)
    for (const double at : local_position(shape, i))
      sheet.start_positions.push_back(0.98 * at +
                                      1e-3 * static_cast<double>(random()) / random.max());
  sheet.pins = {{{0}, {}}};
  return sheet;
}

Scene rough_scene(const std::vector<BendingLaw>& laws) {
  Scene scene;
  for (const BendingLaw& law : laws) scene.sheets.push_back(rough_sheet(Grid{4, 17, 0.01}, law));
  scene.colliders.push_back({"sphere", Sphere{{0.1, -0.05, 0.02}, 0.05}, 0.3, {}});
  scene.colliders.push_back({"plane", Plane{}, 0.3, {}});
  scene.environment.wind = {.velocity = {1, 2, 3}, .gust = 0.5, .tangential_drag = 0.1};
  scene.solver.frame_step = 2.5e-4;
  return scene;
}

// Of triangles.
Collider rough_body() {
  const BodyMesh mesh{
      {{0, -0.02, -0.01}, {0.05, -0.02, 0}, {0.02, -0.02, 0.06}, {0.02, 0.004, 0.02}},
      {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}}};
  return {"body", make_body(mesh, {.cell = 2e-3, .reach = 2e-3}, "body").body, 0.3, {}};
}

// Two sheets that pass through each other, of which the seams of one close, on a deflated body.
Scene dressed_scene() {
  Scene scene = rough_scene({});
  for (const SheetShape& shape : {rough_mesh(), SheetShape(Grid{3, 5, 0.01})})
    scene.sheets.push_back(rough_sheet(shape, Isometric{}));
  std::vector<double>& start = scene.sheets[1].start_positions;
  for (std::size_t i = 1; i < start.size(); i += 3) start[i] += 0.2 * (start[i - 1] - 0.01);
  std::vector<double>& open = scene.sheets[0].start_positions;
  open[open.size() - 3] += 0.02;
  scene.colliders.push_back(rough_body());
  scene.cloth_contact = true;
  for (SheetDefinition& sheet : scene.sheets) sheet.textile.damping_ratio = 0.02;
  scene.solver.step_bound = StepBound::kUnsheared;
  scene.dressing = {.close = 5e-4, .settle = 2.5e-4, .deflate = 1e-3, .holds = {{1, {0, 3}, 0}}};
  return scene;
}

// Two swatches that fall evenly, one above the other, until the lower one meets a plane.
Scene landing_scene() {
  Scene scene;
  for (const double height : {0.0025, 0.005}) {
    SheetDefinition& sheet = scene.sheets.emplace_back(rough_sheet(Grid{3, 5, 0.01}, Isometric{}));
    sheet.pins.clear();
    sheet.start_positions.clear();
    for (int i = 0; i < sheet.particle_count(); ++i) {
      const Vector3d at = local_position(sheet.shape, i);
      sheet.start_positions.insert(sheet.start_positions.end(), {at.x(), at.y() + height, at.z()});
      sheet.start_velocities.insert(sheet.start_velocities.end(), {0, -2, 0});
    }
  }
  scene.colliders.push_back({"plane", Plane{}, 0.3, {}});
  scene.cloth_contact = true;
  scene.solver.frame_step = 1e-3;
  scene.solver.substep = 2e-5;
  return scene;
}

// A swatch that falls onto another as fast as windows of contact are shortened for, of several
// blocks each.
Scene fallen_scene() {
  Scene scene;
  for (const double height : {0.0, 3.5e-3}) {
    SheetDefinition& sheet = scene.sheets.emplace_back(rough_sheet(Grid{7, 9, 0.01}, Isometric{}));
    sheet.pins.clear();
    for (std::size_t i = 1; i < sheet.start_positions.size(); i += 3) {
      sheet.start_positions[i] += height;
      sheet.start_velocities.insert(sheet.start_velocities.end(), {0, height > 0 ? -4.0 : 0, 0});
    }
  }
  scene.cloth_contact = true;
  scene.solver.frame_step = 1e-3;
  return scene;
}

}  // namespace

std::uint64_t fingerprint() {
  std::uint64_t hash = 0xcbf29ce484222325;  // FNV-1a
  const auto add = [&](double value) {
    hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 0x100000001b3;
  };
  ChoiKo series, exact, segments, optimal, polynomial;
  series.evaluator = Evaluator::kSeries;
  exact.evaluator = Evaluator::kExact;
  segments = {.segments = 60, .fold_clamp = true, .diagonal_bend = false};
  optimal.optimal_breakpoints = true;
  polynomial.evaluator = Evaluator::kPolynomial;
  Scene single = rough_scene({ChoiKo{}, segments, optimal, polynomial, Isometric{}});
  Scene twofold = rough_scene({ChoiKo{}, Isometric{}});
  const Scene plain = rough_scene({series, exact});
  for (Scene* scene : {&single, &twofold})
    scene->sheets.push_back(rough_sheet(rough_mesh(), Isometric{}));
  twofold.solver.precision = Precision::kDouble;
  Scene tethered = single;
  for (SheetDefinition& sheet : tethered.sheets) sheet.tether_stretch = 0;
  // in steps so short that slow forces act rarely
  Scene draft = single;
  draft.solver = default_settings(Accuracy::kDraft);
  draft.solver.frame_step = 2.5e-4;
  draft.solver.substep = 2.5e-5;
  for (SheetDefinition& sheet : draft.sheets) sheet.textile.damping_ratio = 0.02;
  const Scene dressed = dressed_scene();
  Scene fine = dressed;
  fine.solver = default_settings(Accuracy::kFine);
  fine.solver.frame_step = dressed.solver.frame_step;
  for (const Scene& scene :
       {single, twofold, plain, tethered, draft, dressed, fine, fallen_scene(), landing_scene()}) {
    Simulation simulation(scene);
    std::vector<double> x(3 * static_cast<std::size_t>(simulation.particle_count()));
    for (int frame = 0; frame < 4; ++frame) {
      if (!simulation.advance_frame()) break;
      simulation.copy_positions(x);
      for (const double value : x) add(value);
    }
  }
  return hash;
}

}  // namespace weft

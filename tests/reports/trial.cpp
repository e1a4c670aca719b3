#include "tests/reports/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "core/triangles/cut.h"
#include "tests/support/core/scenes.h"

namespace weft::reports {
namespace {

constexpr ChoiKo kTruthsLaw{.evaluator = Evaluator::kPolynomial, .degree = 24};

// A tarpaulin, whose bending moves it.
constexpr MeasuredTextile kTarpaulin{.areal_density = 0.5,
                                     .tensile_warp = 2000,
                                     .tensile_weft = 2000,
                                     .shear = 200,
                                     .bend_rigidity_warp = 5e-4,
                                     .bend_rigidity_weft = 5e-4,
                                     .air_drag = 0.02};

SheetDefinition square(int side, const MeasuredTextile& textile, bool triangles = false) {
  const double spacing = 1.0 / (side - 1);
  SheetDefinition sheet = testing::flat_sheet(side, side, spacing);
  if (triangles)
    sheet.shape = complete(triangle_mesh(cut_rectangle(Cut::kIrregular, 1, 1, spacing)));
  sheet.textile.model = textile;
  sheet.skin = 0.003;
  return sheet;
}

// Start positions with x and z multiplied, and a bump of `height` (m) out of the plane: a sheet
// that is quite flat would buckle as rounding wills.
void bend(SheetDefinition& sheet, double x, double z, double height) {
  Matrix3Xd start = start_positions(sheet);
  const Vector3d origin = sheet.origin;
  for (auto particle : start.colwise()) {
    const Vector3d local = particle - origin;
    particle = origin + Vector3d(x * local.x(),
                                 height * std::sin(std::numbers::pi * local.x()) *
                                     std::cos(std::numbers::pi * local.z()),
                                 z * local.z());
  }
  sheet.start_positions = testing::values(start);
}

Scene hang(int side, bool triangles) {
  SheetDefinition sheet = square(side, kWool, triangles);
  sheet.pins = {{{0, side - 1}, {}}};
  bend(sheet, 0.99, 1, 0.03);
  Scene scene;
  scene.sheets = {sheet};
  return scene;
}

Scene buckle(int side) {
  SheetDefinition sheet = square(side, kTarpaulin);
  bend(sheet, 0.9, 1, 0.1);
  Scene scene;
  scene.sheets = {sheet};
  scene.environment.gravity.setZero();
  return scene;
}

Scene flag(int side, bool triangles) {
  SheetDefinition sheet = square(side, kWool, triangles);
  Pin pole;
  for (int row = 0; row < side; ++row) pole.particles.push_back(row * side);
  sheet.pins = {pole};
  sheet.origin = {0, 1, 0};
  sheet.rotation = Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitX());
  Scene scene;
  scene.sheets = {sheet};
  scene.environment.wind =
      Wind{.velocity = {6, 0, 1}, .gust = 0.4, .gust_period = 2, .tangential_drag = 0.02};
  return scene;
}

// Falls from 15 mm above a body, a little beside its middle.
Scene fall(int side, const Collider& body, double top, bool triangles) {
  SheetDefinition sheet = square(side, kWool, triangles);
  sheet.origin = {-0.48, top + 0.015, -0.51};
  bend(sheet, 0.999, 0.999, 0.01);
  Scene scene;
  scene.sheets = {sheet};
  scene.colliders = {body};
  return scene;
}

Scene taut(int side) {
  SheetDefinition sheet = square(side, kWool);
  Pin rim;
  for (int row = 0; row < side; ++row)
    for (int column = 0; column < side; ++column)
      if (row == 0 || column == 0 || row == side - 1 || column == side - 1)
        rim.particles.push_back(row * side + column);
  sheet.pins = {rim};
  Matrix3Xd start = testing::stretched(sheet, 0.05);
  for (auto particle : start.colwise())
    particle.y() = 0.02 * std::sin(std::numbers::pi * particle.x() / 1.05) *
                   std::sin(std::numbers::pi * particle.z() / 1.05);
  sheet.start_positions = testing::values(start);
  Scene scene;
  scene.sheets = {sheet};
  return scene;
}

Scene scene_of(const std::string& name, int side, bool triangles) {
  if (name == "hang") return hang(side, triangles);
  if (name == "buckle") return buckle(side);
  if (name == "flag") return flag(side, triangles);
  if (name == "sphere")
    return fall(side, {"ball", Sphere{{0, 0.3, 0}, 0.3}, 0.3, {}}, 0.6, triangles);
  if (name == "box")
    return fall(side, {"table", Box{{0, 0.2, 0}, {0.25, 0.2, 0.25}}, 0.3, {}}, 0.4, triangles);
  if (name == "taut") return taut(side);
  throw std::invalid_argument("no scene " + name);
}

Simulation begin(const Case& given, const Setting& setting, const BendingLaw& law) {
  Scene scene = given.scene;
  scene.sheets[0].bending = law;
  scene.solver.integrator = setting.integrator;
  scene.solver.precision = setting.precision;
  scene.solver.plain = setting.plain;
  scene.solver.substep =
      scene.solver.frame_step / static_cast<double>(given.substeps * setting.finer);
  scene.solver.allow_unstable = true;
  scene.solver.max_repairs = 0;
  return Simulation(std::move(scene));
}
Simulation begin(const Case& given, const Setting& setting) {
  return begin(given, setting, given.triangles ? BendingLaw(Isometric{}) : setting.law);
}

Outcome run(Simulation simulation, int frames) {
  Outcome outcome;
  outcome.finite = true;
  const std::clock_t start = std::clock();
  for (int frame = 0; frame < frames && outcome.finite; ++frame)
    outcome.finite = simulation.advance_frame();
  outcome.time = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / simulation.time();
  outcome.substep = simulation.plan().step.substep;
  outcome.x = testing::positions(simulation);
  const FrameStats stats = simulation.stats();
  outcome.energy = stats.kinetic_energy + stats.potential_energy;
  return outcome;
}

}  // namespace

std::string Case::title() const { return fmt::format("{0}, {1} x {1}", name, side); }

namespace {

Case planned(Case made, double damping) {
  made.scene.sheets[0].textile.damping = damping;
  if (const auto problems = find_problems(made.scene); !problems.empty())
    throw std::invalid_argument(problems[0].field + ": " + problems[0].message);
  made.substeps = Simulation(made.scene).plan().step.substeps;
  return made;
}

}  // namespace

Case make_case(const std::string& name, int side, double damping) {
  return planned({name, side, scene_of(name, side, false), 0, name == "taut"}, damping);
}

Case make_triangle_case(const std::string& name, int side) {
  Case made{name + " of triangles", side, scene_of(name, side, true), 0, false, true};
  made.scene.sheets[0].bending = Isometric{};
  return planned(std::move(made), kDamping);
}

std::string evaluator_name(const ChoiKo& law) {
  switch (law.evaluator) {
    case Evaluator::kSeries:
      return "series";
    case Evaluator::kExact:
      return "exact";
    case Evaluator::kPolynomial:
      return fmt::format("polynomial {}", law.degree);
    case Evaluator::kLinearized:
      break;
  }
  return fmt::format("{} segments{}{}", law.segments, law.optimal_breakpoints ? ", optimal" : "",
                     law.fold_clamp ? ", folded" : "");
}

std::string integrator_name(IntegratorKind kind) {
  switch (kind) {
    case IntegratorKind::kEuler:
      return "Euler";
    case IntegratorKind::kMidpoint:
      return "midpoint";
    case IntegratorKind::kRk4:
      return "RK4";
    case IntegratorKind::kLaggedVerlet:
      return "lagged Verlet";
    case IntegratorKind::kVerlet:
      break;
  }
  return "Verlet";
}

Outcome run(const Case& given, const Setting& setting, int frames) {
  return run(begin(given, setting), frames);
}

Outcome run(const Case& given, const NamedAccuracy& stated, int frames) {
  Scene scene = given.scene;
  scene.solver = default_settings(stated.accuracy);
  scene.solver.step_bound = stated.step_bound.value_or(scene.solver.step_bound);
  scene.solver.integrator = stated.integrator.value_or(scene.solver.integrator);
  if (stated.self_weight_strain) scene.solver.max_self_weight_strain = stated.self_weight_strain;
  scene.solver.slow_forces_every =
      stated.slow_forces_every.value_or(scene.solver.slow_forces_every);
  if (!given.triangles)
    scene.sheets[0].bending = stated.bending.value_or(default_bending(stated.accuracy));
  return run(Simulation(std::move(scene)), frames);
}

double rounding(const Case& given, const BendingLaw& law, int frames) {
  const auto end = [&](Precision precision) {
    return run(begin(given, {.precision = precision}, law), frames).x;
  };
  return rms(end(Precision::kSingle) - end(Precision::kDouble));
}

int calm_frames(const Case& given, int most) {
  constexpr double kCalm = 1e-3;  // m
  Simulation coarse = begin(given, {.precision = Precision::kDouble});
  Simulation fine = begin(given, {.precision = Precision::kDouble, .finer = 2});
  for (int frame = 0; frame < most; ++frame)
    if (!coarse.advance_frame() || !fine.advance_frame() ||
        largest(testing::positions(coarse) - testing::positions(fine)) >= kCalm)
      return frame;
  return most;
}

double rms(const Matrix3Xd& difference) {
  return std::sqrt(difference.squaredNorm() / static_cast<double>(difference.cols()));
}

double largest(const Matrix3Xd& difference) { return difference.colwise().norm().maxCoeff(); }

Truth find_truth(const Case& given, int frames) {
  Setting setting{.law = kTruthsLaw, .precision = Precision::kDouble};
  if (given.smooth) setting.integrator = IntegratorKind::kRk4;
  const auto at = [&](int finer) {
    setting.finer = finer;
    return run(given, setting, frames);
  };
  const Outcome coarse = at(8), middle = at(16), fine = at(32);
  Truth truth;
  truth.order = std::log2(rms(coarse.x - middle.x) / rms(middle.x - fine.x));
  const double share = 1 / (std::exp2(std::clamp(truth.order, 1.0, given.smooth ? 4.0 : 2.0)) - 1);
  truth.x = fine.x + share * (fine.x - middle.x);
  truth.energy = fine.energy + share * (fine.energy - middle.energy);
  truth.error = rms(truth.x - fine.x);
  return truth;
}

double error_of_truths_bending() {
  const PolynomialBending polynomial(kTruthsLaw.degree);
  const ExactBending exact;
  constexpr int kPoints = 10'000;
  double error = 0;
  for (int k = 0; k <= kPoints; ++k) {
    const double r = static_cast<double>(k) / kPoints;
    error = std::max(error, std::abs(polynomial.value(r) / exact.value(r) - 1));
  }
  return error;
}

}  // namespace weft::reports

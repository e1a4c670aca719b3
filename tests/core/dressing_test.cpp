#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/cloth_contact/cuts.h"
#include "core/forces/elastic.h"
#include "core/sheet_factory.h"
#include "core/simulation.h"
#include "core/triangles/ease.h"
#include "core/triangles/triangles.h"
#include "core/verdict.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/sewn_tube.h"
#include "tests/support/core/wrapped_solver.h"

namespace weft::testing {
namespace {

// The same beside a bar that the edges from panel to panel start through, but no particle is in.
constexpr double kBar = 0.01;  // its radius, m
const Vector3d kBarOutside(0.0985, 0, 0.042);
Scene around_pole_and_bar(const Vector3d& at) {
  Scene scene = around_pole(0.05);
  const Vector3d end = Vector3d::UnitY();
  scene.colliders.push_back({"bar", Capsule{at - end, at + end, kBar}, 0, {}});
  return scene;
}

// The same around a band, too, that is held upright.
Scene around_pole_and_band() {
  constexpr int kRows = 21, kColumns = 3;
  Scene scene = around_pole(0.05);
  SheetDefinition band = scene.sheets[0];
  band.name = "band";
  band.shape = Grid{kRows, kColumns, 0.01};
  band.pins.resize(1);
  for (int i = 0; i < kRows * kColumns; ++i) {
    band.start_positions.insert(band.start_positions.end(),
                                {0.08, 0.01 * (i / kColumns) - 0.05, 0.01 * (i % kColumns) + 0.03});
    band.pins[0].particles.push_back(i);
  }
  scene.sheets.push_back(band);
  scene.cloth_contact = true;
  return scene;
}

std::int64_t counted_cuts(const Simulation& simulation) {
  const std::vector<SheetDefinition>& sheets = simulation.scene().sheets;
  const Matrix3Xd x = positions(simulation);
  const int first = sheets[0].particle_count();
  return count_cuts(sheets, {x.leftCols(first), x.rightCols(x.cols() - first)}).count;
}

double mean_height(const Simulation& simulation) { return positions(simulation).row(1).mean(); }

TEST(Dressing, StartsWithoutStrainAndEndsWithTheFlatShape) {
  const SheetDefinition sheet = around_pole(0.05).sheets[0];
  const Mesh flat = make_triangles(sheet);
  Mesh at_start = flat, at_end = flat;
  ease(sheet, 0, at_start);
  ease(sheet, 1, at_end);
  const Matrix3Xd x = start_positions(sheet);
  EXPECT_GT(largest_strain(flat, x), 5);
  EXPECT_LT(largest_strain(at_start, x), 1e-9);
  for (std::size_t t = 0; t < flat.surface.membrane.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(at_end.surface.membrane[t].du[k], flat.surface.membrane[t].du[k], 1e-9);
      EXPECT_NEAR(at_end.surface.membrane[t].dv[k], flat.surface.membrane[t].dv[k], 1e-9);
    }
}

TEST(Dressing, ForcesOfAnEasedMeshAreTheGradientOfItsEnergy) {
  const SheetDefinition sheet = around_pole(0.05).sheets[0];
  Mesh mesh = make_triangles(sheet);
  ease(sheet, 0.4, mesh);
  Matrix3Xd x = start_positions(sheet), force = Matrix3Xd::Zero(3, x.cols());
  add_elastic_forces(mesh, x, Matrix3Xd::Zero(3, x.cols()), force);
  constexpr double kStep = 1e-6;
  for (const int i : {0, 1, 5, kTubeColumns, 3 * kTubeColumns})
    for (int axis = 0; axis < 3; ++axis) {
      const double at = x(axis, i);
      x(axis, i) = at + kStep;
      const double more = elastic_energy(mesh, x);
      x(axis, i) = at - kStep;
      const double less = elastic_energy(mesh, x);
      x(axis, i) = at;
      EXPECT_NEAR(force(axis, i), (less - more) / (2 * kStep), 1e-5);
    }
}

TEST(Dressing, PanelsCloseAroundABodyAndKeepTheirSize) {
  Simulation simulation(around_pole(0.05));
  dress(simulation, 90);
  for (const int row : {2, 5, 8})
    EXPECT_NEAR(girth(simulation, row), 2 * kPanelWidth, 0.01 * kPanelWidth);
  const Matrix3Xd x = positions(simulation);
  EXPECT_GT(std::sqrt((x.row(0).array().square() + x.row(2).array().square()).minCoeff()), 0.05);
  EXPECT_TRUE(simulation.repairs().empty());
}

// With a fold along a seam, whose angle eases, too.
TEST(Dressing, ASheetThatKeepsItsSolverMovesAsOneWhoseSolverIsMadeAnew) {
  Scene scene = around_pole(0.05);
  TriangleMesh folded = sewn_tube();
  Fold& fold = folded.folds.emplace_back();
  fold.angle = 1;
  for (int row = 0; row <= kTubeRows; ++row) fold.particles.push_back(row * (kTubeColumns + 1));
  scene.sheets[0].shape = complete(folded);
  const auto anew = [](const Scene& of, const SheetDefinition& sheet, const Mesh& its,
                       const Dynamics& dynamics) -> std::unique_ptr<SheetSolver> {
    return std::make_unique<WrappedSolver>(make_solver(of, sheet, its, dynamics));
  };
  Simulation kept(scene), made(scene, anew);
  for (int frame = 0; frame < 60; ++frame) {
    dress(kept, 1);
    dress(made, 1);
    ASSERT_EQ(positions(kept), positions(made)) << frame;
  }
}

TEST(Dressing, AGarmentThatIsTooTightIsStretchedByWhatTheBodyIsLarger) {
  constexpr double kRadius = 0.068;  // with the skin 8 % more girth than the tube has
  Scene scene = around_pole(kRadius);
  scene.environment.gravity = Vector3d::Zero();
  Simulation simulation(scene);
  dress(simulation, 120);
  // a polygon on the skin, whose threads are shortened along the pole by nothing
  const double turn = std::numbers::pi / (2 * kTubeColumns);
  const double wanted = 4 * kTubeColumns * (kRadius + 0.001) * std::sin(turn);
  EXPECT_GT(wanted, 1.08 * 2 * kPanelWidth);
  for (const int row : {2, 5, 8}) EXPECT_NEAR(girth(simulation, row), wanted, 0.003 * wanted);
}

// Of a ring under tension: p = T / r.
TEST(Dressing, ATightGarmentPressesAsItsTensionOverTheRadius) {
  constexpr double kPole = 0.068;
  Scene scene = around_pole(kPole);
  scene.environment.gravity = Vector3d::Zero();
  Simulation simulation(scene);
  dress(simulation, 120);
  const double stretch = girth(simulation, 5) / (2 * kPanelWidth);
  const double tension = 200 * (stretch * stretch - 1) / 2 * stretch;
  const VectorXd pressure = simulation.pressures(0);
  EXPECT_NEAR(pressure.mean(), tension / kPole, 0.03 * tension / kPole);
  const Verdict verdict = simulation.verdict();
  EXPECT_EQ(verdict.largest_pressure, pressure.maxCoeff());
  EXPECT_NEAR(verdict.strain_weft, stretch - 1, 0.05 * (stretch - 1));
  EXPECT_EQ(verdict.particles_inside, 0);
}

// How near edges of the tube come to an upright axis, m.
double distance_from_axis(const Vector3d& at, const Simulation& simulation) {
  const Matrix3Xd x = positions(simulation);
  double nearest = 1;
  for (const auto& triangle : triangles_of(simulation.scene().sheets[0].shape))
    for (std::size_t k = 0; k < 3; ++k) {
      Vector3d from = x.col(triangle[k]) - at, to = x.col(triangle[(k + 1) % 3]) - at;
      from.y() = to.y() = 0;
      const Vector3d along = to - from;
      const double share =
          std::clamp(-from.dot(along) / std::max(along.squaredNorm(), 1e-12), 0.0, 1.0);
      nearest = std::min(nearest, (from + share * along).norm());
    }
  return nearest;
}

TEST(Dressing, WhatReachesFromPanelToPanelIsNotDrawnThroughABody) {
  Simulation simulation(around_pole_and_bar(kBarOutside));
  EXPECT_LT(distance_from_axis(kBarOutside, simulation), 0.6 * kBar);
  for (int frame = 0; frame < 60; ++frame) {
    dress(simulation, 1);
    if (frame >= 6) {
      // a step of the mesh is as long
      ASSERT_GT(distance_from_axis(kBarOutside, simulation), 0.8 * kBar) << "frame " << frame;
    }
  }
  EXPECT_NEAR(girth(simulation, 5), 2 * kPanelWidth, 0.01 * kPanelWidth);
}

// The bar is inside the tube; the middles of both panels are drawn away from it.
TEST(Dressing, WhatReachesFromPanelToPanelIsNotDrawnThroughABodyByForce) {
  const Vector3d bar(0.075, 0, 0.042);
  Scene scene = around_pole_and_bar(bar);
  scene.colliders.erase(scene.colliders.begin());
  auto& textile = std::get<MeasuredTextile>(scene.sheets[0].textile.model);
  textile.tensile_warp = textile.tensile_weft = 400;
  Pin& pin = scene.sheets[0].pins.emplace_back();
  pin.path = {{0, Vector3d::Zero()}, {0.5, {-0.03, 0, 0}}};
  const std::vector<Vector3d>& start = std::get<Triangles>(scene.sheets[0].shape)->start;
  for (std::size_t i = 0; i < start.size(); ++i)
    if (std::abs(start[i].x()) < 0.01) pin.particles.push_back(static_cast<int>(i));
  Simulation simulation(scene);
  for (int frame = 0; frame < 60; ++frame) {
    dress(simulation, 1);
    ASSERT_GT(distance_from_axis(bar, simulation), 0.5 * kBar) << "frame " << frame;
  }
}

TEST(Dressing, WhatReachesFromPanelToPanelIsNotDrawnThroughCloth) {
  Simulation simulation(around_pole_and_band());
  for (int frame = 0; frame < 90; ++frame) {
    ASSERT_EQ(counted_cuts(simulation), 0) << "frame " << frame;
    dress(simulation, 1);
  }
}

TEST(Dressing, NothingRubsWhileSeamsClose) {
  Scene smooth = around_pole(0.068), rough = smooth;
  rough.sheets[0].textile.friction = 0.5;
  for (Scene* scene : {&smooth, &rough}) scene->colliders[0].friction = 0.5;
  Simulation slides(smooth), rubs(rough);
  for (Simulation* simulation : {&slides, &rubs}) dress(*simulation, 60);
  EXPECT_EQ(hash_of(positions(rubs)), hash_of(positions(slides)));
  for (Simulation* simulation : {&slides, &rubs}) dress(*simulation, 30);
  EXPECT_GT(mean_height(rubs), mean_height(slides) + 0.1);
}

TEST(Dressing, WeightComesInOnceSeamsAreClosed) {
  Scene scene = around_pole(0.05);
  scene.dressing->close = 0.5;
  Simulation simulation(scene);
  const double start = mean_height(simulation);
  dress(simulation, 30);
  EXPECT_NEAR(mean_height(simulation), start, 1e-4);
  dress(simulation, 12);  // settled
  const double settled = mean_height(simulation);
  dress(simulation, 6);
  const double t = 6.0 / 60;
  const double v =
      (settled - mean_height(simulation)) / t - 9.80665 * t / 2;  // it falls freely now
  EXPECT_GT(v, 0);
  EXPECT_LT(v, 9.80665 * 0.2);
}

TEST(Dressing, HeldParticlesKeepTheirHeightUntilTheyAreLetGo) {
  Scene scene = around_pole(0.05);
  std::vector<int> band;
  for (int c = 0; c <= kTubeColumns; ++c) band.push_back(kTubeRows * (kTubeColumns + 1) + c);
  scene.dressing->close = 0.5;
  scene.dressing->holds = {{0, band, 0.5}};
  Simulation simulation(scene);
  const Matrix3Xd start = positions(simulation);
  dress(simulation, 60);
  Matrix3Xd x = positions(simulation);
  double moved = 0;
  for (const int i : band) {
    EXPECT_NEAR(x(1, i), start(1, i), 1e-6);
    moved = std::max(moved, std::abs(x(2, i) - start(2, i)));
  }
  EXPECT_GT(moved, 0.01);  // around the pole
  dress(simulation, 20);
  x = positions(simulation);
  for (const int i : band) EXPECT_LT(x(1, i), start(1, i) - 0.1);
}

TEST(Dressing, AStartInsideAColliderIsToldByPanel) {
  constexpr double kRadius = 0.09;
  const Simulation simulation(around_pole(kRadius));
  const Matrix3Xd start = positions(simulation);
  int front = 0, back = 0;  // seams count with the first panel
  for (const auto& x : start.colwise())
    if (std::hypot(x.x(), x.z()) < kRadius) ++(x.z() < 0 ? back : front);
  ASSERT_GT(back, 0);
  const auto& warnings = simulation.plan().warnings;
  const auto told = std::ranges::find(warnings, "STARTS_INSIDE", &Warning::code);
  ASSERT_NE(told, warnings.end());
  EXPECT_NE(told->message.find("; " + std::to_string(front) + " in panel front, " +
                               std::to_string(back) + " in panel back: "),
            std::string::npos)
      << told->message;
}

TEST(Dressing, CollidersAreSmallerWhileSeamsClose) {
  Scene scene = around_pole(0.09);  // the panels start within it
  scene.dressing->deflate = 0.02;
  scene.dressing->close = 0.2;
  Simulation simulation(scene);
  const auto least = [&] {
    const Matrix3Xd x = positions(simulation);
    return std::sqrt((x.row(0).array().square() + x.row(2).array().square()).minCoeff());
  };
  dress(simulation, 12);
  EXPECT_GT(least(), 0.07);
  EXPECT_LT(least(), 0.085);
  dress(simulation, 12);
  EXPECT_GT(least(), 0.09);
}

TEST(Dressing, IsTheSameFromASnapshotAndAfterADroppedFrame) {
  const Scene scene = around_pole_and_bar(kBarOutside);
  Simulation simulation(scene), restored(scene);
  dress(simulation, 20);
  ASSERT_TRUE(restored.restore(simulation.snapshot()));
  for (int frame = 0; frame < 60; ++frame) {
    ASSERT_TRUE(simulation.advance_frame());
    ASSERT_TRUE(restored.advance_frame());
    ASSERT_EQ(hash_of(positions(restored)), hash_of(positions(simulation))) << "frame " << frame;
    if (frame % 10 == 0) restored.release_memory();
  }
}

TEST(Dressing, NeverRestsBeforeItIsOver) {
  Scene scene = around_pole(0.05);
  scene.environment.gravity = Vector3d::Zero();
  scene.dressing->close = 2;
  scene.sheets[0].shape = complete(TriangleMesh(*std::get<Triangles>(scene.sheets[0].shape)));
  Simulation simulation(scene);
  dress(simulation, 100);
  EXPECT_FALSE(simulation.at_rest());
}

TEST(Dressing, SaysWhatIsWrongWithIt) {
  Scene scene = around_pole(0.05);
  scene.dressing->close = -1;
  scene.dressing->deflate = 0.2;
  scene.dressing->holds = {{0, {3, 100000, 3}, 0.5}, {0, {}, 0.5}};
  scene.sheets[0].bending = ChoiKo{};
  std::vector<std::string> fields;
  for (const Problem& problem : find_problems(scene)) fields.push_back(problem.field);
  EXPECT_EQ(fields, (std::vector<std::string>{"dressing.close_s", "dressing.deflate_m",
                                              "dressing.holds[0].particles[1]",
                                              "dressing.holds[0].particles[2]",
                                              "dressing.holds[1].particles", "sheets[0].bending"}));
}

}  // namespace
}  // namespace weft::testing

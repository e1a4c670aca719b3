#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/forces/curvature.h"
#include "core/forces/elastic.h"
#include "core/forces/membrane.h"
#include "core/model/mesh_problems.h"
#include "core/motion/stability.h"
#include "core/motion/surface_bound.h"
#include "core/simulation.h"
#include "core/triangles/connections.h"
#include "core/triangles/triangles.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/triangle_meshes.h"

namespace weft::testing {
namespace {

MeasuredTextile poplin() {
  return {.areal_density = 0.15,
          .tensile_warp = 1000,
          .tensile_weft = 700,
          .shear = 40,
          .bend_rigidity_warp = 8e-6,
          .bend_rigidity_weft = 5e-6};
}

SheetDefinition cloth_of(TriangleMesh mesh) {
  SheetDefinition sheet;
  sheet.name = "cloth";
  sheet.shape = complete(std::move(mesh));
  sheet.textile.model = poplin();
  sheet.bending = Isometric{};
  return sheet;
}

Scene hung_scene(TriangleMesh mesh) {
  Scene scene;
  scene.sheets.push_back(cloth_of(std::move(mesh)));
  return scene;
}

class OnMeshes : public ::testing::TestWithParam<Cut> {};
INSTANTIATE_TEST_SUITE_P(, OnMeshes,
                         ::testing::Values(Cut::kRight, Cut::kAlternating, Cut::kEquilateral,
                                           Cut::kIrregular));

TEST_P(OnMeshes, TheLinearBoundLiesBelowTheMeasuredStepAndTheEstimateMeetsIt) {
  for (const double strain : {0.0, 0.02}) {
    Scene scene = hung_scene(triangle_mesh(square(GetParam(), 0.12, 0.02)));
    SheetDefinition& sheet = scene.sheets[0];
    const Mesh mesh = make_mesh(sheet);
    const Matrix3Xd x = (1 + strain) * start_positions(sheet);
    const StableStep step =
        stable_step(mesh, mesh.mass.cwiseInverse(), IntegratorKind::kVerlet, 0, x);
    const double measured = measured_step(mesh, x);
    EXPECT_LE(step.linear_bound, measured * 1.003);
    EXPECT_GT(step.linear_bound, 0.6 * measured);
    EXPECT_NEAR(step.estimate / measured, 1, 0.02) << strain;
    EXPECT_GE(step.limiting_particle, 0);
  }
}

TEST(Meshes, ASliverLimitsTheStepAndIsNamed) {
  TriangleMesh mesh = triangle_mesh(square(Cut::kRight, 0.1, 0.02));
  mesh.flat[7].x() += 0.018;  // next to its neighbour
  for (std::size_t i = 0; i < mesh.start.size(); ++i)
    mesh.start[i] = {mesh.flat[i].y(), 0, mesh.flat[i].x()};
  const Simulation simulation(hung_scene(std::move(mesh)));
  const auto& warnings = simulation.plan().warnings;
  const auto sliver = std::find_if(warnings.begin(), warnings.end(),
                                   [](const Warning& each) { return each.code == "SLIVER"; });
  ASSERT_NE(sliver, warnings.end());
  EXPECT_NE(sliver->message.find("triangle"), std::string::npos) << sliver->message;
}

TEST_P(OnMeshes, AHungSheetComesToRestAndKeepsItsEnergyBudget) {
  Scene scene = hung_scene(triangle_mesh(square(GetParam(), 0.2, 0.02)));
  scene.sheets[0].textile.damping = 0.01;
  scene.sheets[0].pins = {{{0}, {}}, {{10}, {}}};
  Simulation simulation(scene);
  ASSERT_FALSE(simulation.refusal());
  int frames = 0;
  while (!simulation.at_rest() && frames < 1200) {
    ASSERT_TRUE(simulation.advance_frame()) << simulation.failure();
    ++frames;
  }
  EXPECT_TRUE(simulation.at_rest());
  EXPECT_TRUE(simulation.repairs().empty());
  EXPECT_LT(simulation.stats().largest_strain, 0.05);
}

TEST(Meshes, ALatticeGivenAsTrianglesHangsLikeTheLattice) {
  Scene lattice;
  lattice.sheets.push_back(cloth_of(triangle_mesh(square(Cut::kAlternating, 0.2, 0.01))));
  lattice.sheets[0].textile.damping = 0.02;
  Scene grid = lattice;
  grid.sheets[0].shape = Grid{21, 21, 0.01};
  for (Scene* scene : {&lattice, &grid}) {
    // two corners of one edge, warp along it
    scene->sheets[0].pins = {{{0, 20}, {}}};
    scene->solver.plain = true;
  }
  std::vector<Vector3d> lowest;
  for (const Scene& scene : {lattice, grid}) {
    Simulation simulation(scene);
    for (int k = 0; k < 600 && !simulation.at_rest(); ++k) ASSERT_TRUE(simulation.advance_frame());
    std::vector<double> x(3 * 441);
    simulation.copy_positions(x);
    lowest.emplace_back(x[430], x[441 + 430], x[2 * 441 + 430]);
  }
  EXPECT_LT((lowest[0] - lowest[1]).norm(), 0.03 * 0.2);
}

TEST(Meshes, PanelsOfOneTextileSewnWithTurnedGrainBendAsOnePiece) {
  // the right half is cut with its grain turned by 90 degrees and its shape moved, of an even
  // textile
  const RestShape whole = square(Cut::kAlternating, 0.2, 0.02);
  TriangleMesh sewn = triangle_mesh(whole);
  TriangleMesh halves;
  halves.start = sewn.start;
  for (const bool right : {false, true}) {
    int count = 0;
    for (const auto& triangle : sewn.triangles) {
      double middle = 0;
      for (const int i : triangle) middle += sewn.flat[static_cast<std::size_t>(i)].y() / 3;
      if ((middle > 0.1) != right) continue;
      halves.triangles.push_back(triangle);
      auto& corners = halves.flat_triangles.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector2d& flat = sewn.flat[static_cast<std::size_t>(triangle[k])];
        corners[k] = static_cast<int>(halves.flat.size());
        halves.flat.push_back(right ? Vector2d(3 - flat.y(), flat.x() + 1) : flat);
      }
      ++count;
    }
    halves.panels.push_back({right ? "right" : "left", count, right ? std::numbers::pi / 2 : 0});
  }
  const auto energy_of = [&](const SheetDefinition& sheet) {
    const Mesh mesh = make_mesh(sheet);
    Matrix3Xd x = start_positions(sheet);
    for (Eigen::Index i = 0; i < x.cols(); ++i)  // a cylinder at an angle
      x.col(i) = Vector3d(x(0, i), -0.5 * std::pow(0.6 * x(0, i) + 0.8 * x(2, i), 2), x(2, i));
    return curvature_energy(mesh.surface, x);
  };
  SheetDefinition one = cloth_of(sewn), two = cloth_of(halves);
  EXPECT_TRUE(find_problems(*std::get<Triangles>(two.shape), "").empty());
  EXPECT_NEAR(energy_of(two) / energy_of(one), 1, 1e-9);
}

// Triangles around one particle, side by side.
TriangleMesh disc_of(int triangles) {
  TriangleMesh mesh;
  mesh.flat.emplace_back(0, 0);
  for (int k = 0; k < triangles; ++k) {
    const double angle = 2 * std::numbers::pi * k / triangles;
    mesh.flat.emplace_back(std::cos(angle), std::sin(angle));
    mesh.triangles.push_back({0, k + 1, (k + 1) % triangles + 1});
  }
  for (const Vector2d& flat : mesh.flat) mesh.start.emplace_back(flat.y(), 0, flat.x());
  mesh.panels = {{"disc", triangles}};
  return mesh;
}

TEST(Meshes, FaultsOfTrianglesAreNamedWithTheirPlace) {
  const auto problems = [](const std::function<void(TriangleMesh&)>& spoil) {
    TriangleMesh mesh = triangle_mesh(square(Cut::kRight, 0.1, 0.05));
    spoil(mesh);
    std::string all;
    for (const Problem& problem : find_problems(*complete(mesh), "mesh"))
      all += problem.field + ": " + problem.message + "\n";
    return all;
  };
  const auto says = [](const std::string& all, const std::string& part) {
    return all.find(part) != std::string::npos;
  };
  EXPECT_EQ(problems([](TriangleMesh&) {}), "");
  EXPECT_TRUE(says(problems([](TriangleMesh& m) { m.triangles[2][1] = 99; }),
                   "mesh.triangles: triangle 2 has a corner of index 99; there are 9"));
  EXPECT_TRUE(says(problems([](TriangleMesh& m) { std::swap(m.flat[4], m.flat[8]); }),
                   "runs clockwise in the flat shape"));
  EXPECT_TRUE(
      says(problems([](TriangleMesh& m) { m.flat[4] = m.flat[3]; }), "has a height of 0 m"));
  EXPECT_TRUE(says(problems([](TriangleMesh& m) { m.start[1].x() = std::nan(""); }),
                   "mesh.positions_m: point 1 has a coordinate of nan m"));
  EXPECT_TRUE(says(problems([](TriangleMesh& m) {
                     m.triangles.push_back({0, 2, 4});
                   }),
                   "mesh.triangles: the edge between particles 0 and 4 has 3 triangles"));
  EXPECT_TRUE(says(problems([](TriangleMesh& m) {
                     m.triangles.push_back({0, 1, 3});
                   }),
                   "run along their edge between particles 0 and 1 in the same direction"));
  EXPECT_TRUE(says(problems([](TriangleMesh& m) {
                     m.start.emplace_back(0, 0, 0);
                     m.flat.emplace_back(0, 0);
                   }),
                   "mesh.positions_m: particle 9 is in no triangle"));
  EXPECT_TRUE(says(problems([](TriangleMesh& m) { m = disc_of(201); }),
                   "mesh.triangles: particle 0 is a corner of 201 triangles; 200 at most meet"));
  EXPECT_TRUE(problems([](TriangleMesh& m) { m = disc_of(200); }).empty());
  EXPECT_TRUE(says(problems([](TriangleMesh& m) {
                     m.panels = {{"front", 3}};
                   }),
                   "mesh.panels: have 3 triangles; the mesh has 8"));
}

TEST(Meshes, RawTextilesNeedConnections) {
  Scene scene = hung_scene(triangle_mesh(square(Cut::kRight, 0.1, 0.05)));
  scene.sheets[0].textile.model = RawTextile{.particle_mass = 0.001, .stretch = 100};
  const auto problems = find_problems(scene);
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_EQ(problems[0].field, "sheets[0].textile.raw");
  scene.sheets[0].bending = ChoiKo{};
  EXPECT_TRUE(find_problems(scene).empty());
}

TEST(Meshes, ConnectionsBendAndStretchAnEvenTextileRightOnEquilateralTrianglesAlone) {
  MeasuredTextile even = poplin();
  even.tensile_weft = even.tensile_warp;
  even.shear = even.tensile_warp / 2;  // no direction of its own
  even.bend_rigidity_weft = even.bend_rigidity_warp;
  const auto error_on = [&](Cut cut) {
    SheetDefinition sheet = cloth_of(triangle_mesh(square(cut, 1, 0.04)));
    sheet.textile.model = even;
    sheet.bending = ChoiKo{};
    Mesh mesh;
    return add_connections(sheet, rest_shape(triangles_in(sheet)), mesh);
  };
  const ConnectionError equilateral = error_on(Cut::kEquilateral);
  EXPECT_NEAR(equilateral.least_stretch, 1, 0.02);  // what is left is the border's
  EXPECT_NEAR(equilateral.most_stretch, 1, 0.02);
  EXPECT_NEAR(equilateral.least_bend, 1, 0.1);
  EXPECT_NEAR(equilateral.most_bend, 1, 0.1);
  const ConnectionError right = error_on(Cut::kRight);
  EXPECT_GT(right.most_bend / right.least_bend, 1.3);
}

TEST(Meshes, ThePapersLawHangsASheetAndSaysThatItDependsOnTheMesh) {
  Scene scene = hung_scene(triangle_mesh(square(Cut::kIrregular, 0.2, 0.04)));
  SheetDefinition& sheet = scene.sheets[0];
  sheet.pins = {{{0, 5}, {}}};
  for (const Evaluator evaluator :
       {Evaluator::kSeries, Evaluator::kExact, Evaluator::kLinearized, Evaluator::kPolynomial}) {
    sheet.bending = ChoiKo{.evaluator = evaluator};
    Simulation simulation(scene);
    for (int k = 0; k < 30; ++k) ASSERT_TRUE(simulation.advance_frame()) << simulation.failure();
    EXPECT_TRUE(simulation.repairs().empty());
    const auto& warnings = simulation.plan().warnings;
    EXPECT_TRUE(std::any_of(warnings.begin(), warnings.end(),
                            [](const Warning& each) { return each.code == "MESH_DEPENDENT"; }));
  }
}

}  // namespace
}  // namespace weft::testing

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/forces/elastic.h"
#include "core/lattice/coarser.h"
#include "core/model/mesh.h"
#include "core/sheet_factory.h"
#include "core/simulation.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

const Action kRelax{.kind = Action::Kind::kRelax};
constexpr double kWeightOfKilogram = 9.80665;

// A square of 1 m, of a textile that is soft to the hand and hardly stretches.
SheetDefinition square_sheet(int side) {
  SheetDefinition sheet = flat_sheet(side, side, 1.0 / (side - 1));
  sheet.textile = {.model = MeasuredTextile{.areal_density = 0.2,
                                            .tensile_warp = 500,
                                            .tensile_weft = 500,
                                            .shear = 50,
                                            .bend_rigidity_warp = 1e-5,
                                            .bend_rigidity_weft = 1e-5,
                                            .air_drag = 0.4}};
  sheet.bending = Isometric{};
  return sheet;
}

// By two corners.
Scene hung(int side) {
  Scene scene;
  scene.sheets = {square_sheet(side)};
  scene.sheets[0].pins = {{{0, side - 1}, {}}};
  return scene;
}

// Until it is at rest; how many frames that took.
int relax(Simulation& simulation) {
  EXPECT_FALSE(simulation.act({kRelax}));
  int frames = 0;
  for (; frames < 1000 && !simulation.at_rest(); ++frames) EXPECT_TRUE(simulation.advance_frame());
  EXPECT_TRUE(simulation.at_rest());
  return frames;
}

void move(Simulation& simulation, int frames) {
  for (int i = 0; i < frames; ++i) ASSERT_TRUE(simulation.advance_frame());
}

double rms(const Matrix3Xd& x) {
  return std::sqrt(x.squaredNorm() / static_cast<double>(x.cols()));
}

TEST(Relaxation, EndsWhereTheForcesOfTheEquationsAreNoMoreThanAThousandthOfTheWeight) {
  Scene scene = hung(31);
  scene.solver.precision = Precision::kDouble;
  Simulation simulation(scene);
  relax(simulation);
  EXPECT_LE(simulation.residual().value(), 1e-3);
  EXPECT_EQ(simulation.kinetic_energy(), 0);

  const Mesh mesh = make_mesh(scene.sheets[0]);
  const Matrix3Xd x = positions(simulation);
  Matrix3Xd force = Vector3d(0, -kWeightOfKilogram, 0) * mesh.mass.transpose();
  add_elastic_forces(mesh, x, Matrix3Xd::Zero(3, x.cols()), force);
  force.col(0).setZero();
  force.col(30).setZero();
  Vector3d sum = Vector3d::Zero();
  for (const auto& f : force.colwise()) sum += f;
  // single particles swing about their place without end; all of them together hang still
  EXPECT_LT(sum.norm(), 0.03 * 0.2 * kWeightOfKilogram);
}

TEST(Relaxation, ComesToAPlaceThatTheMotionStaysAt) {
  Simulation simulation(hung(31));
  relax(simulation);
  const Matrix3Xd rest = positions(simulation);
  ASSERT_FALSE(simulation.act({{.kind = Action::Kind::kGrab, .particle = 480},
                               {.kind = Action::Kind::kRelease, .particle = 480}}));
  EXPECT_FALSE(simulation.asleep());
  for (int frame = 0; frame < 300 && !simulation.at_rest(); ++frame) move(simulation, 1);
  EXPECT_TRUE(simulation.at_rest());
  EXPECT_LT(rms(positions(simulation) - rest), 0.001);
}

TEST(Relaxation, AStripHungByItsEndsIsACatenary) {
  constexpr int kColumns = 61;
  Scene scene;
  SheetDefinition strip = flat_sheet(3, kColumns, 1.0 / (kColumns - 1));
  strip.textile = square_sheet(3).textile;
  strip.bending = Isometric{};
  const Path inward = {{0, {0, 0, 0}}, {0.5, {0.1, 0, 0}}},
             outward = {{0, {0, 0, 0}}, {0.5, {-0.1, 0, 0}}};
  for (int row = 0; row < 3; ++row) {
    strip.pins.push_back({{row * kColumns}, inward});
    strip.pins.push_back({{row * kColumns + kColumns - 1}, outward});
  }
  scene.sheets = {strip};
  Simulation simulation(scene);
  relax(simulation);

  // L = 2 a sinh(d / 2a), sag = a (cosh(d / 2a) - 1)
  const double d = 0.8, length = 1;
  double a = 0.1;
  for (int i = 0; i < 200; ++i) {
    const double f = 2 * a * std::sinh(d / (2 * a)) - length;
    const double slope = 2 * std::sinh(d / (2 * a)) - d / a * std::cosh(d / (2 * a));
    a -= f / slope;
  }
  const double sag = a * (std::cosh(d / (2 * a)) - 1);
  EXPECT_NEAR(positions(simulation)(1, kColumns + kColumns / 2), -sag, 0.003);
}

TEST(Relaxation, BeginsOnceNothingElseMovesTheScene) {
  Scene scene = hung(9);
  scene.sheets[0].pins[0].path = {{0, {0, 0, 0}}, {0.5, {0, 0.1, 0}}};
  Simulation simulation(scene), other(scene);
  ASSERT_FALSE(simulation.act({kRelax}));
  for (int frame = 0; frame < 30; ++frame) {
    EXPECT_FALSE(simulation.residual());
    move(simulation, 1);
    move(other, 1);
    ASSERT_EQ(hash_of(positions(simulation)), hash_of(positions(other)));
  }
  move(simulation, 1);
  EXPECT_TRUE(simulation.residual());

  Textile heavier = scene.sheets[0].textile;
  std::get<MeasuredTextile>(heavier.model).areal_density *= 2;
  ASSERT_FALSE(simulation.set_textile(0, heavier, 0.1));
  ASSERT_FALSE(simulation.act({kRelax}));
  move(simulation, 5);
  EXPECT_FALSE(simulation.residual());
  move(simulation, 1);
  EXPECT_TRUE(simulation.residual());
}

TEST(Relaxation, EndsWithTheNextActionAndTheSceneMovesOn) {
  Scene scene = hung(31);
  scene.sheets[0].textile.damping = 0.02;
  Simulation simulation(scene);
  const double damping = simulation.plan().dampings[0].damping;
  ASSERT_FALSE(simulation.act({kRelax}));
  move(simulation, 3);
  EXPECT_TRUE(simulation.residual());
  ASSERT_FALSE(simulation.act({{.kind = Action::Kind::kUnpin, .particle = 0}}));
  EXPECT_FALSE(simulation.residual());
  EXPECT_EQ(simulation.plan().dampings[0].damping, damping);
  const double before = positions(simulation)(1, 0);
  move(simulation, 12);
  EXPECT_LT(positions(simulation)(1, 0), before - 0.1);  // falls for 0.2 s
}

TEST(Relaxation, AsksFewerParticlesFirst) {
  Scene scene = hung(41);
  Simulation simulation(scene);
  ASSERT_FALSE(simulation.act({kRelax}));
  move(simulation, 1);
  // a frame's own motion is no more than a fall from standing
  EXPECT_LT(positions(simulation).row(1).minCoeff(), -0.7);

  scene.cloth_contact = true;  // the coarser lattice could be through itself
  Simulation alone(scene);
  ASSERT_FALSE(alone.act({kRelax}));
  move(alone, 1);
  EXPECT_GT(positions(alone).row(1).minCoeff(), -0.01);
}

TEST(Relaxation, ATextileThatIsRefusedChangesNothing) {
  Scene scene = hung(31);
  scene.sheets[0].textile.damping = 0.02;
  Simulation simulation(scene), other(scene);
  for (Simulation* each : {&simulation, &other}) {
    each->limit_frame_work(961 * 2 * each->plan().step.substeps);
    ASSERT_FALSE(each->act({kRelax}));
    move(*each, 2);
  }
  Textile stiff = scene.sheets[0].textile;
  std::get<MeasuredTextile>(stiff.model).tensile_warp = 1e5;
  ASSERT_TRUE(simulation.set_textile(0, stiff));
  ASSERT_TRUE(simulation.set_textile(0, stiff, 1));
  for (int frame = 0; frame < 10; ++frame) {
    move(simulation, 1);
    move(other, 1);
    ASSERT_EQ(hash_of(positions(simulation)), hash_of(positions(other)));
  }
}

TEST(Relaxation, InPartsOrTakenBackIsTheSameToTheBit) {
  Simulation whole(hung(33)), in_parts(hung(33));
  std::mt19937 random(1);
  ASSERT_FALSE(whole.act({kRelax}));
  ASSERT_FALSE(in_parts.act({kRelax}));
  const Enough enough = [&] { return random() % 16 == 0; };
  int parts = 0, drops = 0;
  for (int frame = 0; frame < 6; ++frame) {
    for (;;) {
      const FramePart part = in_parts.advance_frame(enough);
      ASSERT_NE(part, FramePart::kFailed);
      if (part == FramePart::kDone) break;
      EXPECT_GT(in_parts.frame_share(), 0);
      ++parts;
      if (frame == 0 && parts % 20 == 7 && drops < 3 && in_parts.drop_frame()) ++drops;
    }
    ASSERT_TRUE(whole.advance_frame());
    EXPECT_EQ(hash_of(positions(in_parts)), hash_of(positions(whole)));
    EXPECT_EQ(in_parts.residual(), whole.residual());
  }
  EXPECT_GT(parts, 20);
  EXPECT_EQ(drops, 3);
}

TEST(Relaxation, GoesOnFromASnapshotToTheBit) {
  const Scene scene = hung(31);
  Simulation simulation(scene);
  ASSERT_FALSE(simulation.act({kRelax}));
  for (int frame = 0; frame < 8; ++frame) {
    Simulation restored(scene);
    ASSERT_TRUE(restored.restore(simulation.snapshot()));
    for (int i = 0; i < 3; ++i) {
      ASSERT_TRUE(simulation.advance_frame());
      ASSERT_TRUE(restored.advance_frame());
    }
    EXPECT_EQ(hash_of(positions(restored)), hash_of(positions(simulation)));
    EXPECT_EQ(restored.snapshot().relaxation, simulation.snapshot().relaxation);
  }
}

TEST(Relaxation, TrianglesAndClothOnABodyComeToRestToo) {
  TriangleMesh mesh;
  const auto side = 12;
  for (int i = 0; i < side * side; ++i)
    mesh.flat.emplace_back(0.03 * (i % side), 0.03 * (i / side));
  for (int r = 0; r + 1 < side; ++r)
    for (int c = 0; c + 1 < side; ++c) {
      const int i = r * side + c;
      mesh.triangles.push_back({i, i + 1, i + side + 1});
      mesh.triangles.push_back({i, i + side + 1, i + side});
    }
  for (const Vector2d& flat : mesh.flat) mesh.start.emplace_back(flat.x(), 0.101, flat.y());
  SheetDefinition sheet;
  sheet.shape = complete(mesh);
  sheet.textile = square_sheet(3).textile;
  sheet.bending = Isometric{};
  Scene scene;
  scene.sheets = {sheet};
  scene.colliders = {{"ball", Sphere{Vector3d(0.165, 0, 0.165), 0.1}, 0.3, {}}};
  Simulation simulation(scene);
  relax(simulation);
  const Matrix3Xd rest = positions(simulation);
  EXPECT_NEAR(rest.row(1).maxCoeff(), 0.1, 0.005);
  EXPECT_LT(rest.row(1).minCoeff(), 0.05);
}

TEST(CoarserLattice, HasHalfTheRowsAndColumnsOfASheetAndItsWeight) {
  const Scene scene = hung(101);
  const Matrix3Xd x = start_positions(scene.sheets[0]);
  const auto coarser = coarser_scene(scene, {x}, 0);
  ASSERT_TRUE(coarser);
  ASSERT_TRUE(find_problems(*coarser).empty());
  const SheetDefinition& sheet = coarser->sheets[0];
  EXPECT_EQ(sheet.particle_count(), 51 * 51);
  EXPECT_EQ(sheet.pins[0].particles, (std::vector<int>{0, 50}));
  EXPECT_NEAR(make_mesh(sheet).mass.sum(), 0.2, 1e-12);
  EXPECT_FALSE(coarser_scene(hung(21), {start_positions(hung(21).sheets[0])}, 0));
}

TEST(CoarserLattice, OfRawConstantsWeighsAndBendsAlike) {
  Scene scene = hung(61);
  const double h = 1.0 / 60, rigidity = 1e-5, mass = 0.2 * h * h;
  scene.sheets[0].textile = {.model = RawTextile{.particle_mass = mass,
                                                 .stretch = 500,
                                                 .shear = 50,
                                                 .bend = 2.0 / 3 * rigidity * h,
                                                 .air_drag = 2 * mass}};
  const auto coarser = coarser_scene(scene, {start_positions(scene.sheets[0])}, 0);
  ASSERT_TRUE(coarser);
  const auto& raw = std::get<RawTextile>(coarser->sheets[0].textile.model);
  EXPECT_NEAR(raw.particle_mass / (4 * h * h), 0.2, 1e-12);
  EXPECT_NEAR(1.5 * raw.bend / (2 * h), rigidity, 1e-15);
  EXPECT_NEAR(raw.air_drag / raw.particle_mass, 2, 1e-12);
}

TEST(CoarserLattice, CoversSheetsWhoseSidesAreNoMultiples) {
  for (const auto& [rows, columns] : {std::pair(30, 45), std::pair(48, 33), std::pair(32, 97)}) {
    Scene scene = hung(31);
    scene.sheets[0].shape = Grid{rows, columns, 0.01};
    scene.sheets[0].pins.clear();
    const auto coarser = coarser_scene(scene, {start_positions(scene.sheets[0])}, 0);
    ASSERT_TRUE(coarser);
    const Grid& grid = grid_of(coarser->sheets[0]);
    EXPECT_NEAR(grid.spacing * (grid.rows - 1), 0.01 * (rows - 1), 0.01 * 0.01 * rows);
    EXPECT_NEAR(grid.spacing * (grid.columns - 1), 0.01 * (columns - 1), 0.01 * 0.01 * columns);
  }
}

TEST(CoarserLattice, ValuesThatAreLinearInThePlaceAreResampledExactly) {
  const Grid from{5, 7, 0.1}, to{23, 11, 0.1};
  const auto field = [](const Grid& grid) {
    Matrix3Xd values(3, grid.rows * grid.columns);
    for (int i = 0; i < values.cols(); ++i) {
      const double u = static_cast<double>(i % grid.columns) / (grid.columns - 1);
      const double v = static_cast<double>(i / grid.columns) / (grid.rows - 1);
      values.col(i) = Vector3d(1 + u, 2 * v - u, 3);
    }
    return values;
  };
  EXPECT_LT((resample(field(from), from, to) - field(to)).cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace weft::testing

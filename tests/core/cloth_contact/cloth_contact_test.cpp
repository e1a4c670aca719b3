#include "core/cloth_contact/cloth_contact.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <regex>
#include <string>
#include <utility>

#include "tests/support/core/bodies.h"
#include "tests/support/core/last_first.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/touching_sheets.h"

namespace weft::testing {
namespace {

// Two sheets that meet crumpled and fast, one of each kind; without weight or air.
Scene collision(Precision precision, unsigned seed = 1, double haste = 1) {
  SheetDefinition one = soft_lattice(9, 9), other = soft_rectangle(0.08, 0.08);
  other.origin = {0.003, 0.01, -0.002};
  for (SheetDefinition* sheet : {&one, &other}) {
    const int n = sheet->particle_count();
    const double down = sheet == &other ? -1 : 1;
    sheet->start_velocities = values(
        (haste * ((0.3 * noise(n, seed)).colwise() + Vector3d(0.2 * down, 0.6 * down, 0))).eval());
    sheet->start_positions = values((start_positions(*sheet) + 1e-3 * noise(n, seed + 1)).eval());
    seed += 2;
  }
  Scene scene = touching({one, other});
  scene.environment.gravity.setZero();
  scene.solver.precision = precision;
  scene.solver.frame_step = 0.01;
  return scene;
}

struct Momenta {
  Vector3d linear = Vector3d::Zero(), angular = Vector3d::Zero();  // kg m/s, kg m^2/s
};
Momenta momenta(const Simulation& simulation) {
  const Matrix3Xd x = positions(simulation), v = velocities(simulation);
  Momenta sum;
  Eigen::Index k = 0;
  for (const SheetDefinition& sheet : simulation.scene().sheets) {
    const Mesh mesh = make_mesh(sheet);
    for (Eigen::Index i = 0; i < mesh.mass.size(); ++i, ++k) {
      const Vector3d momentum = mesh.mass[i] * v.col(k);
      sum.linear += momentum;
      sum.angular += x.col(k).cross(momentum);
    }
  }
  return sum;
}

TEST(ClothContact, KeepsMomentumAndAngularMomentum) {
  Scene scene = collision(Precision::kDouble);
  for (SheetDefinition& sheet : scene.sheets) {
    sheet.textile.damping = 0;
    sheet.textile.friction = 0;
  }
  Simulation simulation(scene);
  const Momenta before = momenta(simulation);
  for (int frame = 0; frame < 12; ++frame) ASSERT_TRUE(simulation.advance_frame());
  const Momenta after = momenta(simulation);
  const double mass = 2 * 0.2 * 0.0064, speed = 0.6, reach = 0.1;
  EXPECT_LT((after.linear - before.linear).norm(), 1e-9 * mass * speed);
  EXPECT_LT((after.angular - before.angular).norm(), 5e-3 * mass * speed * reach);

  scene.cloth_contact = false;
  Simulation passing(scene);
  for (int frame = 0; frame < 12; ++frame) ASSERT_TRUE(passing.advance_frame());
  EXPECT_GT((positions(passing) - positions(simulation)).colwise().norm().maxCoeff(), 0.01);
}

TEST(ClothContact, ASheetComesToLieOnAnotherAtItsThickness) {
  SheetDefinition below = soft_rectangle(0.1, 0.1), above = soft_rectangle(0.1, 0.1);
  above.name = "above";
  above.origin = {0.002, 0.006, 0.003};
  below.thickness = 1.5e-3;
  above.thickness = 2.5e-3;
  Scene scene = touching({below, above});
  scene.colliders.push_back({"floor", Plane{Vector3d(0, -0.001, 0)}, 0.5, {}});
  Simulation simulation(scene);
  for (int frame = 0; frame < 60; ++frame) ASSERT_TRUE(simulation.advance_frame());
  const std::vector<Matrix3Xd> x = by_sheet(simulation, positions(simulation));
  const double apart = x[1].row(1).mean() - x[0].row(1).mean();
  EXPECT_NEAR(apart, 2e-3, 1e-4);
  EXPECT_EQ(cuts_now(simulation), 0);
}

TEST(ClothContact, AStackOfSheetsIsCarriedByTheLowest) {
  constexpr int kSheets = 8;
  std::vector<SheetDefinition> sheets;
  for (int s = 0; s < kSheets; ++s) {
    sheets.push_back(soft_rectangle(0.05, 0.05));
    sheets.back().name = std::to_string(s);
    sheets.back().origin = {1e-3 * s, 2.2e-3 * s, -7e-4 * s};
  }
  Scene scene = touching(sheets);
  scene.colliders.push_back({"floor", Plane{Vector3d(0, -1e-3, 0)}, 0.5, {}});
  Simulation simulation(scene);
  for (int frame = 0; frame < 30; ++frame) ASSERT_TRUE(simulation.advance_frame());
  const std::vector<Matrix3Xd> x = by_sheet(simulation, positions(simulation));
  const double thickness = 2e-3;
  for (std::size_t s = 1; s < x.size(); ++s) {
    // the floor lifts the lowest after cloth has met
    const double within = (s == 1 ? 0.1 : 0.01) * thickness;
    EXPECT_NEAR(x[s].row(1).mean() - x[s - 1].row(1).mean(), thickness, within) << s;
  }
  EXPECT_LT(simulation.kinetic_energy(), 3e-6);
  EXPECT_EQ(cuts_now(simulation), 0);
}

// Two sheets one over the other, held at their borders, which go down by so much in half a second.
Scene held_in_layers(double apart, double down) {
  std::vector<SheetDefinition> sheets;
  for (int s = 0; s < 2; ++s) {
    SheetDefinition& sheet = sheets.emplace_back(soft_rectangle(0.2, 0.2));
    sheet.name = std::to_string(s);
    sheet.textile = soft_cloth(0.1);
    sheet.textile.damping_ratio = 0.1;
    sheet.origin = {-0.1, apart * s, -0.1};
    const Matrix3Xd x = start_positions(sheet);
    Pin& border = sheet.pins.emplace_back();
    for (int i = 0; i < sheet.particle_count(); ++i)
      if (std::max(std::abs(x(0, i)), std::abs(x(2, i))) > 0.099) border.particles.push_back(i);
    border.path = {{0, Vector3d::Zero()}, {0.5, Vector3d(0, -down, 0)}};
  }
  return touching(sheets);
}

TEST(ClothContact, OfSheetsThatAreHeldCloserThanTheirThicknessStaysCalm) {
  Simulation simulation(held_in_layers(1e-3, 0));
  for (int frame = 0; frame < 6; ++frame) ASSERT_TRUE(simulation.advance_frame());
  EXPECT_TRUE(simulation.repairs().empty());
  EXPECT_LT(simulation.kinetic_energy(), 1e-3);
  EXPECT_EQ(cuts_now(simulation), 0);
}

TEST(ClothContact, DoesNotPressTautLayersIntoTheBodyBeneath) {
  constexpr double kRadius = 0.06;
  Scene scene = held_in_layers(2.5e-3, 0.06);
  Collider ball = solid(ball_mesh(kRadius, 4), 0.1);
  ball.name = "ball";
  ball.path = {{0, Vector3d(0, -kRadius - 2.1e-3, 0)}};
  scene.colliders = {ball};
  Simulation simulation(scene);
  for (int frame = 0; frame < 32; ++frame) ASSERT_TRUE(simulation.advance_frame());
  const Matrix3Xd all = positions(simulation);
  for (const auto x : all.colwise())
    EXPECT_GT((x + Vector3d(0, kRadius + 2.1e-3, 0)).norm(), kRadius - 1e-4);
  EXPECT_EQ(cuts_now(simulation), 0);
}

// Also where pairs are those of a plain search.
std::unique_ptr<SheetSolver> solver_in_vectors(const Scene& scene, const SheetDefinition& sheet,
                                               const Mesh& mesh, const Dynamics& dynamics) {
  Scene other = scene;
  other.solver.plain = false;
  return make_solver(other, sheet, mesh, dynamics);
}

// Bit for bit.
TEST(ClothContact, MissesNoPairThatAPlainSearchOfAllFinds) {
  for (const Precision precision : {Precision::kSingle, Precision::kDouble}) {
    for (const auto& [seed, haste] : {std::pair(1U, 1.0), {10U, 1.0}, {20U, 6.0}}) {
      SCOPED_TRACE(seed);
      Scene listed = collision(precision, seed, haste);
      listed.solver.frame_step = 0.005;
      Scene plain = listed;
      plain.solver.plain = true;
      Simulation one(listed, solver_in_vectors), other(plain, solver_in_vectors);
      const std::vector<Matrix3Xd> start = by_sheet(one, positions(one));
      for (int frame = 0; frame < 8; ++frame) {
        ASSERT_TRUE(one.advance_frame());
        ASSERT_TRUE(other.advance_frame());
        ASSERT_EQ(positions(one), positions(other)) << frame;
      }
    }
  }
}

TEST(ClothContact, ErrsOfFirstOrderInTheSafetyOfSteps) {
  const auto end = [](double safety) {
    Scene scene = collision(Precision::kDouble, 1, 0.25);
    scene.solver.frame_step = 0.03;
    scene.solver.substep = 1e-5;
    scene.solver.safety = safety;
    Simulation simulation(scene);
    EXPECT_TRUE(simulation.advance_frame());
    return positions(simulation);
  };
  const Matrix3Xd in_each_step = end(0.01);
  const double standard = (end(0.9) - in_each_step).norm(),
               fine = (end(0.225) - in_each_step).norm();
  ASSERT_GT(standard, 1e-3);
  EXPECT_LT(fine, 0.35 * standard);
}

// Bit for bit: pins rest while nothing is near, and then jerk one sheet through the other.
TEST(ClothContact, MissesNoPairWhereAPinBeginsToMoveWithinAWindow) {
  constexpr double kSpeed = 20;  // m/s
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    SheetDefinition above = soft_lattice(9, 9), below = soft_rectangle(0.08, 0.08);
    above.origin.y() = 2.2e-3 + 2e-4 * seed;
    const Vector3d aside = 0.2 * noise(1, seed);
    const Vector3d way = 0.04 * (aside - Vector3d::UnitY()).normalized();
    const double begin = 7e-4 + 1.3e-4 * seed;
    above.pins.push_back(
        {{40 + static_cast<int>(seed)},
         {{0, Vector3d::Zero()}, {begin, Vector3d::Zero()}, {begin + way.norm() / kSpeed, way}}});
    Scene listed = touching({above, below});
    listed.environment.gravity.setZero();
    listed.solver.frame_step = 0.001;
    listed.solver.substep = 4e-5;  // six of them in a window
    Scene plain = listed;
    plain.solver.plain = true;
    Simulation one(listed, solver_in_vectors), other(plain, solver_in_vectors),
        restored(listed, solver_in_vectors);
    for (int frame = 0; frame < 5; ++frame) {
      ASSERT_TRUE(restored.restore(one.snapshot()));
      for (Simulation* each : {&one, &other, &restored}) ASSERT_TRUE(each->advance_frame());
      ASSERT_EQ(positions(one), positions(other)) << frame;
      ASSERT_EQ(positions(one), positions(restored)) << frame;
    }
  }
}

// Bit for bit: layers fall evenly, and the lower one meets a body before they meet each other.
TEST(ClothContact, MissesNoPairOfLayersThatFallEvenlyOntoABody) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    SheetDefinition above = soft_lattice(9, 9), below = soft_rectangle(0.08, 0.08);
    above.origin.y() = 2.2e-3 + 1.5e-4 * seed;
    for (SheetDefinition* sheet : {&above, &below}) {
      const Vector3d velocity(0, -4, 0);
      sheet->start_velocities = values(Matrix3Xd(velocity.replicate(1, sheet->particle_count())));
    }
    Scene listed = touching({above, below});
    Collider ball = solid(ball_mesh(0.03, 3));
    ball.path = {{0, Vector3d(0.04, -0.034 - 1.3e-4 * seed, 0.04)}};
    listed.colliders = {ball};
    listed.solver.frame_step = 0.002;
    listed.solver.substep = 2.5e-5;
    Scene plain = listed;
    plain.solver.plain = true;
    Simulation one(listed, solver_in_vectors), other(plain, solver_in_vectors),
        restored(listed, solver_in_vectors);
    listed.cloth_contact = false;
    Simulation passing(listed);
    int same = 0;
    for (int frame = 0; frame < 5; ++frame) {
      ASSERT_TRUE(restored.restore(one.snapshot()));
      for (Simulation* each : {&one, &other, &restored, &passing})
        ASSERT_TRUE(each->advance_frame());
      ASSERT_EQ(positions(one), positions(other)) << frame;
      ASSERT_EQ(positions(one), positions(restored)) << frame;
      same += positions(one) == positions(passing) ? 1 : 0;
    }
    EXPECT_LT(same, 5) << "they met";
  }
}

// Bit for bit: one that is folded over swings together, of which nothing is near to begin with.
TEST(ClothContact, MissesNoPairOfASheetThatSwingsTogetherFromAfar) {
  for (SheetDefinition sheet : {soft_rectangle(0.16, 0.08), soft_lattice(17, 9)}) {
    SCOPED_TRACE(sheet.name);
    Matrix3Xd x = start_positions(sheet), v = Matrix3Xd::Zero(3, x.cols());
    const double half = 0.08, angle = 0.9;
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
      const bool along = sheet.name == "triangles";
      const double s = (along ? x(0, i) : x(2, i)) - half, across = along ? x(2, i) : x(0, i);
      x.col(i) = Vector3d(across, std::abs(s) * std::sin(angle), s * std::cos(angle));
      v.col(i) = Vector3d(0.3, 0, -30 * s);
    }
    sheet.start_positions = values((x + 1e-4 * noise(static_cast<int>(x.cols()))).eval());
    sheet.start_velocities = values(v);
    Scene listed = touching({sheet});
    listed.environment.gravity.setZero();
    listed.solver.frame_step = 0.005;
    Scene plain = listed;
    plain.solver.plain = true;
    Simulation one(listed, solver_in_vectors), other(plain, solver_in_vectors);
    listed.cloth_contact = false;
    Simulation passing(listed);
    int same = 0;  // frames before anything met
    for (int frame = 0; frame < 8; ++frame) {
      for (Simulation* each : {&one, &other, &passing}) ASSERT_TRUE(each->advance_frame());
      ASSERT_EQ(positions(one), positions(other)) << frame;
      same += positions(one) == positions(passing) ? 1 : 0;
    }
    EXPECT_GT(same, 0);
    EXPECT_LT(same, 8);
  }
}

TEST(ClothContact, DoesNotDependOnThreads) {
  SheetDefinition below = soft_lattice(65, 128, 0.005), above = soft_rectangle(0.2, 0.2, 0.005);
  above.origin.y() = 0.003;
  above.start_velocities.assign(3 * static_cast<std::size_t>(above.particle_count()), -0.3);
  Scene scene = touching({below, above});
  scene.solver.frame_step = 0.004;
  Simulation one(scene), other(scene);
  LastFirst pool(4);
  for (int frame = 0; frame < 1; ++frame) {
    ASSERT_TRUE(one.advance_frame());
    ASSERT_TRUE(other.advance_frame(pool));
  }
  EXPECT_EQ(positions(one), positions(other));
}

TEST(ClothContact, GoesOnFromASnapshotToTheBit) {
  for (const Precision precision : {Precision::kSingle, Precision::kDouble}) {
    const Scene scene = collision(precision);
    Simulation one(scene), other(scene);
    for (int frame = 0; frame < 3; ++frame) ASSERT_TRUE(one.advance_frame());
    ASSERT_TRUE(other.restore(one.snapshot()));
    one.release_memory();
    for (int frame = 0; frame < 3; ++frame) {
      ASSERT_TRUE(one.advance_frame());
      ASSERT_TRUE(other.advance_frame());
    }
    EXPECT_EQ(positions(one), positions(other));
  }
}

// A patch on a sheet that is pinned all over and inclined.
double slide(double friction, double angle) {
  SheetDefinition slope = soft_rectangle(0.3, 0.1), patch = soft_rectangle(0.04, 0.04);
  patch.name = "patch";
  const Quaterniond turn(Eigen::AngleAxisd(-angle, Vector3d::UnitZ()));
  const double thickness = 2e-3;
  slope.rotation = patch.rotation = turn;
  patch.origin = turn * Vector3d(0.053, thickness, 0.031);
  for (SheetDefinition* sheet : {&slope, &patch}) sheet->textile = soft_cloth(friction);
  Pin& all = slope.pins.emplace_back();
  for (int i = 0; i < slope.particle_count(); ++i) all.particles.push_back(i);
  Simulation simulation(touching({slope, patch}));
  const auto way = [&] {
    return Vector3d(by_sheet(simulation, positions(simulation))[1].rowwise().mean())
        .dot(turn * Vector3d::UnitX());
  };
  for (int frame = 0; frame < 15; ++frame) EXPECT_TRUE(simulation.advance_frame());
  const double begin = way();
  for (int frame = 0; frame < 30; ++frame) EXPECT_TRUE(simulation.advance_frame());
  return way() - begin;
}

TEST(ClothContact, APatchSlidesDownAnInclinedSheetBeyondTheAngleOfFriction) {
  const double half_degree = std::numbers::pi / 360;
  for (const double friction : {0.2, 0.5}) {
    const double angle = std::atan(friction);
    EXPECT_LT(slide(friction, angle - half_degree), 2e-4) << friction;
    EXPECT_GT(slide(friction, angle + half_degree), 2e-3) << friction;
  }
}

TEST(ClothContact, IsNamedInThePlanWithWhatItCostsOrWhyItIsSkipped) {
  Scene scene = touching({soft_lattice(5, 4)});
  std::get<MeasuredTextile>(scene.sheets[0].textile.model).tensile_warp = 1e4;
  const Plan plan = Simulation(scene).plan();
  const auto steps = static_cast<int>(2.5e-4 / plan.step.substep);
  ASSERT_GT(steps, 1);
  const std::string line = "lattice: cloth contact at 0.002 m, 24 triangles, every " +
                           std::to_string(steps) + " substeps or fewer";
  EXPECT_THAT(plan.passes, ::testing::Contains(line));
  scene.cloth_contact = false;
  const Plan without = Simulation(scene).plan();
  EXPECT_TRUE(
      std::any_of(without.skipped.begin(), without.skipped.end(), [](const SkippedPass& skipped) {
        return skipped.pass == "cloth contact" && skipped.reason == "cloth_contact is not set";
      }));
}

TEST(ClothContact, ThicknessIsBoundedByTheMesh) {
  Scene scene = touching({soft_lattice(3, 3)});
  EXPECT_EQ(scene.sheets[0].thickness_or_default(), 2e-3);
  scene.sheets[0].thickness = 2.6e-3;
  const std::vector<Problem> problems = find_problems(scene);
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_EQ(problems[0].field, "sheets[0].thickness_m");
  EXPECT_EQ(problems[0].message, "0.0026 m is not within 1e-06 to 0.0025 m");
  scene.sheets[0] = soft_lattice(3, 3, 0.004);
  EXPECT_EQ(scene.sheets[0].thickness_or_default(), 1e-3);
}

TEST(ClothContact, IsAskedForAndThenNotWarnedOf) {
  Scene scene = touching({soft_lattice(3, 3), soft_rectangle(0.02, 0.02)});
  scene.sheets[1].origin.y() = 0.1;
  const auto codes = [&] {
    std::vector<std::string> found;
    const Simulation simulation(scene);
    for (const Warning& warning : simulation.plan().warnings)
      if (warning.code.find("COLLISION") != std::string::npos || warning.code == "TANGLED_START")
        found.push_back(warning.code);
    return found;
  };
  EXPECT_EQ(codes(), std::vector<std::string>{});
  scene.sheets[1].origin.y() = 0.001;
  EXPECT_EQ(codes(), std::vector<std::string>{"TANGLED_START"});
  // of panels, those of the first triangle of what is named
  TriangleMesh mesh = *std::get<Triangles>(scene.sheets[1].shape);
  const int half = static_cast<int>(mesh.triangles.size()) / 2;
  mesh.panels = {{"left", half, 0}, {"right", half, 0}};
  scene.sheets[1].shape = complete(mesh);
  std::swap(scene.sheets[0], scene.sheets[1]);  // what is told is of the first
  const Simulation simulation(scene);
  const std::string& told =
      std::ranges::find(simulation.plan().warnings, "TANGLED_START", &Warning::code)->message;
  std::smatch named;
  ASSERT_TRUE(std::regex_search(told, named, std::regex("triangles ([0-9]+) of panel (\\w+)")))
      << told;
  const auto first = std::ranges::find_if(mesh.triangles, [&](const auto& triangle) {
    return std::ranges::find(triangle, std::stoi(named[1])) != triangle.end();
  });
  EXPECT_EQ(named[2], first - mesh.triangles.begin() < half ? "left" : "right");
  scene.cloth_contact = false;
  EXPECT_EQ(codes(), (std::vector<std::string>{"NO_SELF_COLLISION", "NO_SHEET_SHEET_COLLISION"}));
}

}  // namespace
}  // namespace weft::testing

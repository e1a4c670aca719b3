#include "core/cloth_contact/untangling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/cloth_contact/cuts.h"
#include "core/simulation.h"
#include "core/triangles/cut.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

SheetDefinition swatch(const char* name) {
  SheetDefinition sheet;
  sheet.name = name;
  sheet.shape = complete(triangle_mesh(cut_rectangle(Cut::kAlternating, 0.1, 0.1, 0.01)));
  sheet.textile.model = light_textile(0.2);
  sheet.bending = Isometric{};
  return sheet;
}

// Weightless sheets.
Scene weightless(const std::vector<SheetDefinition>& sheets, std::optional<double> untangle) {
  Scene scene;
  scene.sheets = sheets;
  scene.environment.gravity.setZero();
  scene.cloth_contact = true;
  scene.untangle = untangle;
  return scene;
}

// Two swatches, each with a corner through the other. tilt: radians
Scene crossing(std::optional<double> untangle, double tilt = 0.7) {
  SheetDefinition one = swatch("one"), other = swatch("other");
  Matrix3Xd x = start_positions(other);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(tilt, Vector3d::UnitZ()).toRotationMatrix();
  for (auto at : x.colwise()) at = (turn * at + Vector3d(0.043, -0.021, 0.047)).eval();
  other.start_positions = values(x);
  return weightless({one, other}, untangle);
}

// A strip that is rolled up so far that an end of it has gone through what lies under it.
Scene rolled(std::optional<double> untangle) {
  SheetDefinition sheet = swatch("roll");
  sheet.shape = complete(triangle_mesh(cut_rectangle(Cut::kAlternating, 0.2, 0.03, 0.01)));
  constexpr double kRadius = 0.025;
  Matrix3Xd x = start_positions(sheet);
  for (auto at : x.colwise()) {
    const double angle = at.x() / kRadius, radius = kRadius * (1 - 0.03 * angle);
    at << radius * std::sin(angle), -radius * std::cos(angle), at.z();
    if (angle > 6.6) at.y() -= 0.35 * kRadius;
  }
  sheet.start_positions = values(x);
  return weightless({sheet}, untangle);
}

// A strip that hangs through the middle of a swatch.
Scene through_a_slit(double untangle) {
  SheetDefinition sheet = swatch("sheet"), strip = swatch("strip");
  strip.shape = complete(triangle_mesh(cut_rectangle(Cut::kAlternating, 0.1, 0.03, 0.01)));
  Matrix3Xd x = start_positions(strip);
  for (auto at : x.colwise()) at = Vector3d(0.052, at.x() - 0.047, at.z() + 0.033);
  strip.start_positions = values(x);
  return weightless({sheet, strip}, untangle);
}

std::int64_t cuts_of(const Simulation& simulation) { return *simulation.stats().cloth_cuts; }

void go_on(Simulation& simulation, int frames) {
  for (int i = 0; i < frames; ++i) ASSERT_TRUE(simulation.advance_frame()) << simulation.failure();
}

Vector3d momentum_of(const Simulation& simulation) {
  const Scene& scene = simulation.scene();
  const Matrix3Xd v = velocities(simulation);
  Vector3d sum = Vector3d::Zero();
  Eigen::Index first = 0;
  for (const SheetDefinition& sheet : scene.sheets) {
    const VectorXd mass = make_mesh(sheet).mass;
    sum += v.middleCols(first, mass.size()) * mass;
    first += mass.size();
  }
  return sum;
}

TEST(Untangling, SwatchesThatCrossComeApart) {
  Simulation untangled(crossing(10)), tangled(crossing(std::nullopt));
  EXPECT_GT(cuts_of(untangled), 10);
  go_on(untangled, 60);
  go_on(tangled, 60);
  EXPECT_EQ(cuts_of(untangled), 0);
  EXPECT_GT(cuts_of(tangled), 10);
}

TEST(Untangling, ARollThatHasGoneThroughItselfComesApart) {
  Simulation simulation(rolled(10));
  EXPECT_GT(cuts_of(simulation), 0);
  go_on(simulation, 60);
  EXPECT_EQ(cuts_of(simulation), 0);
}

// What is farther from the other one than `free` (m) is pinned.
void pin_far_away(double free, Scene& scene) {
  for (std::size_t s = 0; s < 2; ++s) {
    SheetDefinition& sheet = scene.sheets[s];
    const Matrix3Xd x = start_positions(sheet), other = start_positions(scene.sheets[1 - s]);
    Pin& pin = sheet.pins.emplace_back();
    for (int i = 0; i < sheet.particle_count(); ++i)
      if ((other.colwise() - x.col(i)).colwise().norm().minCoeff() > free)
        pin.particles.push_back(i);
  }
}

// Of cloth that does not bend easily.
Scene stiff_crossing(double tensile, double tilt = 0.7) {
  Scene scene = crossing(10, tilt);
  for (SheetDefinition& sheet : scene.sheets) {
    auto& textile = std::get<MeasuredTextile>(sheet.textile.model);
    textile.tensile_warp = textile.tensile_weft = tensile;
    textile.bend_rigidity_warp = textile.bend_rigidity_weft = 1e-4;
  }
  return scene;
}

TEST(Untangling, SwatchesThatAreHeldComeApart) {
  Scene scene = stiff_crossing(200);
  pin_far_away(0.04, scene);
  Simulation simulation(scene);
  EXPECT_GT(cuts_of(simulation), 10);
  go_on(simulation, 60);
  EXPECT_EQ(cuts_of(simulation), 0);
}

TEST(Untangling, SwatchesThatAreHeldTautComeApartWithoutRepairs) {
  for (const double tilt : {0.64, 0.67, 0.7, 0.73, 0.76}) {
    Scene scene = stiff_crossing(2000, tilt);
    pin_far_away(0.025, scene);
    Simulation simulation(scene);
    EXPECT_GT(cuts_of(simulation), 10);
    for (int frame = 0; frame < 60 && cuts_of(simulation) > 0; ++frame) go_on(simulation, 1);
    EXPECT_EQ(cuts_of(simulation), 0) << tilt;
    EXPECT_EQ(simulation.repairs().size(), 0) << tilt;
  }
}

// A bowl of which a particle has gone through what lies beside its neighbours.
Scene folded_at_a_spot() {
  SheetDefinition sheet = swatch("sheet");
  Matrix3Xd x = start_positions(sheet);
  const Vector3d middle = x.rowwise().mean();
  Eigen::Index spot = 0;
  (x.colwise() - middle).colwise().norm().minCoeff(&spot);
  x.col(spot) += Vector3d(0.017, 0, 0.003);
  for (auto at : x.colwise()) at.y() += 6 * (at - middle).squaredNorm();
  x.col(spot).y() -= 2e-4;
  sheet.start_positions = values(x);
  return weightless({sheet}, 10);
}

// Of all sheets' particles, at a time, s: which contact leaves alone.
std::vector<bool> freed_at(double time, const Scene& scene) {
  std::vector<Matrix3Xd> starts;
  for (const SheetDefinition& sheet : scene.sheets) starts.push_back(start_positions(sheet));
  const Cloth cloth(scene.sheets, {});
  const Matrix3Xd x = cloth.positions(starts);
  NearBlocks near(cloth);
  near.set(x);
  Untangling untangling(cloth);
  untangling.set(find_cuts(cloth, near, x), x, Untangling::speed_at(time));
  std::vector<bool> freed;
  for (int i = 0; i < cloth.particles(); ++i) freed.push_back(untangling.has({i, i, i, i}));
  return freed;
}

TEST(Untangling, FreesWhatLiesBesideAFoldThroughItselfOnceItIsFast) {
  const Scene scene = folded_at_a_spot();
  const std::vector<bool> slow = freed_at(0, scene), fast = freed_at(0.9, scene);
  EXPECT_GT(std::ranges::count(slow, true), 0);
  EXPECT_EQ(slow, freed_at(0.7, scene));
  EXPECT_GT(std::ranges::count(fast, true), std::ranges::count(slow, true));
  for (std::size_t i = 0; i < slow.size(); ++i) EXPECT_LE(slow[i], fast[i]) << i;
}

TEST(Untangling, KeepsContactBesideTheLastCutsOfOneSheetThroughAnother) {
  Scene scene = crossing(10);
  SheetDefinition& other = scene.sheets[1];
  Matrix3Xd x = start_positions(other);
  x.row(2).array() += 0.04;  // so that it reaches a little way through
  other.start_positions = values(x);
  const std::int64_t cuts = cuts_of(Simulation(scene));
  EXPECT_GT(cuts, 0);
  EXPECT_LE(cuts, 8);
  EXPECT_EQ(freed_at(0, scene), freed_at(0.9, scene));
}

TEST(Untangling, NothingRestsWhileItIsLedApart) {
  constexpr int kEnd = 90;  // frames
  Scene scene = crossing(1.5);
  for (SheetDefinition& sheet : scene.sheets) sheet.textile.damping_ratio = 0.05;
  pin_far_away(0.005, scene);
  Simulation simulation(scene);
  for (int frame = 1; frame <= kEnd; ++frame) {
    go_on(simulation, 1);
    ASSERT_FALSE(simulation.at_rest()) << "frame " << frame;
  }
  EXPECT_GT(cuts_of(simulation), 0);
  go_on(simulation, 60);
  EXPECT_TRUE(simulation.at_rest());
}

TEST(Untangling, KeepsMomentum) {
  Simulation simulation(crossing(10));
  double most = 0;
  for (int i = 0; i < 20; ++i) {
    go_on(simulation, 1);
    EXPECT_LT(momentum_of(simulation).norm(), 1e-9);
    most = std::max(most, velocities(simulation).colwise().norm().maxCoeff());
  }
  EXPECT_GT(most, 0.05);
}

TEST(Untangling, GoesOnFromASnapshotWithTheSameBits) {
  Simulation simulation(crossing(10));
  go_on(simulation, 2);
  ASSERT_GT(cuts_of(simulation), 0);
  Simulation restored(crossing(10));
  ASSERT_TRUE(restored.restore(simulation.snapshot()));
  simulation.release_memory();
  go_on(simulation, 20);
  go_on(restored, 20);
  EXPECT_EQ(positions(simulation), positions(restored));
}

TEST(Untangling, ChangesNoBitWhereNothingHasPassedThrough) {
  const auto falling = [](std::optional<double> untangle) {
    Scene scene = crossing(untangle);
    SheetDefinition& other = scene.sheets[1];
    other.start_positions = {};
    other.origin = {0.03, 0.01, 0.03};
    other.start_velocities =
        values(Vector3d(0.1, -0.5, 0).replicate(1, other.particle_count()).eval());
    return scene;
  };
  Simulation with(falling(10)), without(falling(std::nullopt));
  go_on(with, 20);
  go_on(without, 20);
  EXPECT_EQ(positions(with), positions(without));
}

TEST(Untangling, SaysWhatCouldNotBeLedApart) {
  Simulation simulation(through_a_slit(0.2));
  go_on(simulation, 30);
  EXPECT_GT(cuts_of(simulation), 0);
  const Verdict verdict = simulation.verdict();
  ASSERT_FALSE(verdict.faults.empty());
  bool told = false;
  for (const Fault& fault : verdict.faults)
    told = told || (fault.code == "CLOTH_CUTS" &&
                    fault.message.ends_with("which could not be led apart within 0.2 s"));
  EXPECT_TRUE(told);
}

TEST(Untangling, IsForScenesWithClothContact) {
  Scene scene = crossing(10);
  for (const Problem& problem : find_problems(scene))
    ADD_FAILURE() << problem.field << " " << problem.message;
  scene.cloth_contact = false;
  ASSERT_EQ(find_problems(scene).size(), 1U);
  EXPECT_EQ(find_problems(scene)[0].field, "cloth_contact");
  scene.cloth_contact = true;
  scene.untangle = -1;
  ASSERT_EQ(find_problems(scene).size(), 1U);
  EXPECT_EQ(find_problems(scene)[0].field, "untangle_s");
}

TEST(Untangling, IsPartOfADressing) {
  Scene scene = crossing(std::nullopt);
  EXPECT_EQ(end_of_untangling(scene), 0);
  scene.dressing.emplace();
  scene.dressing->close = 2;
  scene.dressing->settle = 0.5;
  EXPECT_DOUBLE_EQ(end_of_untangling(scene), 5.5);
  scene.untangle = 0;
  EXPECT_EQ(end_of_untangling(scene), 0);
}

}  // namespace
}  // namespace weft::testing

#include "core/lattice/shown.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/model/actions.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

Grid grid_of_every(int rows, int columns, int every) {
  return {.rows = rows,
          .columns = columns,
          .spacing = 0.01 * every,
          .simulated_every = every,
          .shown_spacing = 0.01};
}

// f(u, v) at each particle, u and v from 0 to 1 along a row and a column.
template <class F>
std::vector<double> field(const SheetShape& shape, const F& f) {
  const Grid& grid = std::get<Grid>(shape);
  std::vector<double> values;
  for (int r = 0; r < grid.rows; ++r)
    for (int c = 0; c < grid.columns; ++c)
      values.push_back(
          f(static_cast<double>(c) / (grid.columns - 1), static_cast<double>(r) / (grid.rows - 1)));
  return values;
}

template <class F>
double largest_error(const SheetShape& shape, const F& f) {
  const std::vector<double> made = shown_values(field(shape, f), {shape});
  const std::vector<double> exact = field(shown(shape), f);
  double largest = 0;
  for (std::size_t i = 0; i < exact.size(); ++i)
    largest = std::max(largest, std::abs(made[i] - exact[i]));
  return largest;
}

TEST(ShownGrid, HasAParticleOfEachThatIsSimulatedAndThoseBetween) {
  const SheetShape shape = grid_of_every(4, 6, 5);
  const Grid all = std::get<Grid>(shown(shape));
  EXPECT_EQ(all.rows, 16);
  EXPECT_EQ(all.columns, 26);
  EXPECT_EQ(all.spacing, 0.01);
  EXPECT_EQ(all.simulated_every, 1);
  for (int i = 0; i < particle_count(shape); ++i) {
    const int there = shown_particle(shape, i);
    EXPECT_EQ(simulated_particle(shape, there), i);
    EXPECT_NEAR((local_position(shape, i) - local_position(shown(shape), there)).norm(), 0, 1e-15);
  }
  EXPECT_EQ(simulated_particle(shape, 1), std::nullopt);
  EXPECT_EQ(simulated_particle(shape, 26), std::nullopt);
}

TEST(ShownGrid, KeepsTheBitsOfParticlesThatAreSimulated) {
  const SheetShape shape = grid_of_every(5, 7, 3);
  const auto wild = [](double u, double v) { return std::sin(40 * u + 1) * std::exp(3 * v); };
  const std::vector<double> simulated = field(shape, wild);
  const std::vector<double> all = shown_values(simulated, {shape});
  for (int i = 0; i < particle_count(shape); ++i)
    EXPECT_EQ(all[static_cast<std::size_t>(shown_particle(shape, i))],
              simulated[static_cast<std::size_t>(i)]);
}

TEST(ShownGrid, IsExactWhereASheetIsFlat) {
  EXPECT_LT(largest_error(grid_of_every(4, 3, 4), [](double u, double v) { return 1 + u - 2 * v; }),
            1e-15);
}

TEST(ShownGrid, IsResampledExactlyToAnyOtherWhereValuesAreLinear) {
  const Grid from{5, 7, 0.1}, to{23, 11, 0.1};
  const auto linear = [](const Grid& grid) {
    Matrix3Xd values(3, grid.rows * grid.columns);
    for (int i = 0; i < values.cols(); ++i) {
      const double u = static_cast<double>(i % grid.columns) / (grid.columns - 1);
      const double v = static_cast<double>(i / grid.columns) / (grid.rows - 1);
      values.col(i) = Vector3d(1 + u, 2 * v - u, 3);
    }
    return values;
  };
  EXPECT_LT((resample(linear(from), from, to) - linear(to)).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(ShownGrid, ComesNearerToABentSheetWithTheThirdPowerOfItsSpacingAtLeast) {
  const auto wave = [](double u, double v) {  // straight at its border, as free edges are
    return std::sin(M_PI * u) * std::sin(M_PI * v);
  };
  const double coarse = largest_error(grid_of_every(9, 9, 4), wave);
  const double fine = largest_error(grid_of_every(17, 17, 4), wave);
  EXPECT_LT(fine, coarse / 7);
  EXPECT_LT(coarse, 2e-3);
}

TEST(ShownGrid, LeavesSheetsBesideItAsTheyAre) {
  const std::vector<SheetShape> sheets{Grid{2, 2, 0.1}, grid_of_every(2, 2, 2), Grid{2, 3, 0.1}};
  std::vector<double> planes;  // x is the number of the particle, y 100 more
  for (int plane = 0; plane < 2; ++plane)
    for (int i = 0; i < 14; ++i) planes.push_back(100 * plane + i);
  const std::vector<double> expected{0, 1,   2, 3, 4, 4.5, 5,  5,  5.5, 6,
                                     6, 6.5, 7, 8, 9, 10,  11, 12, 13};
  const std::vector<double> made = shown_values(planes, sheets);
  ASSERT_EQ(made.size(), 2 * expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(made[i], expected[i], 1e-14);
    EXPECT_NEAR(made[expected.size() + i], 100 + expected[i], 1e-12);
  }
}

TEST(ShownGrid, IsGrabbedAtParticlesThatAreSimulated) {
  SheetDefinition sheet = flat_sheet(5, 5);
  sheet.shape = grid_of_every(5, 5, 4);
  sheet.pins = {{{0}, {}}};
  Simulation simulation(floating(sheet));
  const auto grab = [](int particle) {
    return Action{.kind = Action::Kind::kGrab, .particle = particle};
  };
  EXPECT_TRUE(simulation.problems_of({grab(17 * 16 + 16)}).empty());  // the last one
  const auto between = simulation.problems_of({grab(5)});
  ASSERT_EQ(between.size(), 1u);
  EXPECT_EQ(between[0].field, "actions[0].grab.particle");
  EXPECT_EQ(between[0].message,
            "5 is not simulated, but lies between particles that are: those in each row and column "
            "number 4 from the first on");
  const auto beyond = simulation.problems_of({grab(17 * 17)});
  ASSERT_EQ(beyond.size(), 1u);
  EXPECT_EQ(beyond[0].message, "289 is not within 0 to 288");

  ASSERT_FALSE(simulation.act({grab(4)}));
  Action drag{.kind = Action::Kind::kDrag, .particle = 4, .target = {0, 0.5, 0}};
  drag.duration = 0.1;
  ASSERT_FALSE(simulation.act({drag}));
  for (int frame = 0; frame < 12; ++frame) ASSERT_TRUE(simulation.advance_frame());
  EXPECT_NEAR((positions(simulation).col(1) - drag.target).norm(), 0, 1e-6);
}

}  // namespace
}  // namespace weft::testing

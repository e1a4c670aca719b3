#include "core/motion/rest.h"

#include <gtest/gtest.h>

#include "tests/support/core/scenes.h"

namespace weft {
namespace {

class QuietSheet : public ::testing::Test {
 protected:
  QuietSheet() {
    before_.x = after_.x = start_positions(sheet_);
    before_.v = after_.v = Matrix3Xd::Zero(3, sheet_.particle_count());
  }
  bool quiet(bool by_frame = false) const {
    return is_quiet(mesh_, inverse_mass_, {{0, -9.8, 0}, 0, kFrameStep}, 0.1, before_, after_,
                    by_frame);
  }

  static constexpr double kFrameStep = 0.02;
  const SheetDefinition sheet_ = testing::flat_sheet(4, 4);
  const Mesh mesh_ = make_lattice(sheet_);
  VectorXd inverse_mass_ = mesh_.mass.cwiseInverse();
  SheetState before_, after_;
};

TEST_F(QuietSheet, HardlyMovesAndFeelsNoNetForce) { EXPECT_TRUE(quiet()); }

// 1e-6 m g h are 9.8e-7 m^2/s^2 a mass: a speed of 1.4 mm/s
TEST_F(QuietSheet, MayHaveAMillionthOfTheEnergyOfItsFall) {
  before_.v.setConstant(1.3e-3 / std::sqrt(3.0));
  after_.v = before_.v;
  EXPECT_TRUE(quiet());
  after_.v *= 1.5e-3 / 1.3e-3;
  before_.v = after_.v;
  EXPECT_FALSE(quiet());
}

TEST_F(QuietSheet, MayHaveAnyEnergyWithinAFrameThatAddsUpToNoMotion) {
  before_.v(0, 5) = after_.v(0, 5) = 0.2;
  EXPECT_FALSE(quiet());
  EXPECT_TRUE(quiet(true));
  after_.v = -before_.v;
  before_.v(0, 6) = 0.2;
  EXPECT_TRUE(quiet(true));
  after_.x.row(0).array() += 1.5e-3 * kFrameStep;
  EXPECT_FALSE(quiet(true));
}

// a hundredth of its weight over a frame changes velocities by 1.96 mm/s
TEST_F(QuietSheet, MayFeelAHundredthOfItsWeightAsAMean) {
  after_.v(1, 0) = -1.3e-3;
  before_.v(1, 0) = 1.3e-3;
  EXPECT_TRUE(quiet()) << "one particle of sixteen chatters";
  after_.v.row(1).setConstant(-1.0e-3);
  before_.v.row(1).setConstant(1.0e-3);
  EXPECT_FALSE(quiet());
}

TEST_F(QuietSheet, IsNotDisturbedByParticlesThatAreHeld) {
  after_.v(1, 5) = 3;
  EXPECT_FALSE(quiet());
  inverse_mass_[5] = 0;
  EXPECT_TRUE(quiet());
}

TEST(Rest, ComesAfterThirtyQuietFramesInARow) {
  Rest rest;
  for (int frame = 0; frame < 29; ++frame) rest.add_frame(true);
  EXPECT_FALSE(rest.at_rest());
  rest.add_frame(false);
  for (int frame = 0; frame < 29; ++frame) rest.add_frame(true);
  EXPECT_FALSE(rest.at_rest());
  rest.add_frame(true);
  EXPECT_TRUE(rest.at_rest());
  rest.disturb();
  EXPECT_FALSE(rest.at_rest());
}

}  // namespace
}  // namespace weft

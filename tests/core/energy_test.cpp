#include <gtest/gtest.h>

#include "tests/support/core/energy_trial.h"

namespace weft::testing {
namespace {

// `./dev bench stability` tries 2000 of them.
TEST(Energy, UndisturbedScenesGainNoneUnlessSomebodyIsTold) {
  std::mt19937_64 random(1);
  int told = 0;
  for (int k = 0; k < 40; ++k) {
    const Scene scene = undisturbed_scene(random);
    ASSERT_TRUE(find_problems(scene).empty());
    const EnergyTrial trial = try_energy(scene, 10);
    EXPECT_FALSE(trial.silent_gain())
        << "scene " << k << " gained " << trial.gain << " J of " << trial.stored;
    told += trial.warned || trial.repaired;
  }
  EXPECT_GT(told, 5);
  EXPECT_LT(told, 25);
}

}  // namespace
}  // namespace weft::testing

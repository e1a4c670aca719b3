#include "core/cloth_contact/steady_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tests/support/core/last_first.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

// The longest way between two, m.
double most_apart(const Matrix3Xd& ways) {
  double most = 0;
  for (const auto& one : ways.colwise())
    for (const auto& other : ways.colwise()) most = std::max(most, (one - other).norm());
  return most;
}

constexpr int kCount = 40, kSteps = 4;

TEST(SteadyMotion, KnowsNoLessThanHowFarParticlesComeBesideIt) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const Matrix3Xd from = noise(kCount, seed);
    Matrix3Xd d = 1e-3 * noise(kCount, seed + 100), x = from + d;
    const Matrix3Xd by = d;
    SteadyMotion motion;
    motion.begin(from, from + kSteps * by, kSteps, 1);
    for (int step = 2; step <= 3 * kSteps; ++step) {
      const Matrix3Xd change = 1e-5 * noise(kCount, 1000 * seed + static_cast<unsigned>(step));
      d += change;
      x += d;
      motion.change(2 * std::sqrt(change.colwise().squaredNorm().maxCoeff()));
      motion.step();
      EXPECT_DOUBLE_EQ(motion.times(0), step / double{kSteps});
      const double strays = most_apart(x - from - step * by);
      EXPECT_GE(motion.strays(0, 0), strays);

      SteadyMotion measured = motion;
      measured.measure(x, d, calling_thread());
      EXPECT_GE(measured.strays(0, 0), strays * (1 - 1e-9));
      EXPECT_LT(measured.strays(0, 0), 2 * strays + 1e-12);
      EXPECT_LE(measured.strays(0, 0), motion.strays(0, 0));
      // the next steps, if they change no more
      const double ahead = most_apart(x + 3 * d - from - (step + 3) * by);
      EXPECT_GE(measured.strays(3, 0), ahead * (1 - 1e-9));
      EXPECT_GE(motion.strays(3, 0), measured.strays(3, 0));
    }
  }
}

TEST(SteadyMotion, SaysTheSameOnAllThreads) {
  const int count = 5 * static_cast<int>(kParticlesOfShare) + 3;
  const Matrix3Xd from = noise(count), by = 1e-3 * noise(count, 1), x = from + 1.1 * by,
                  d = 0.9 * by;
  const auto measured = [&](ThreadPool& pool) {
    SteadyMotion motion;
    motion.begin(from, from + by, 1, 1);
    motion.measure(x, d, pool);
    return std::pair(motion.strays(0, 0), motion.strays(1, 0));
  };
  LastFirst three(3);
  EXPECT_EQ(measured(three), measured(calling_thread()));
}

}  // namespace
}  // namespace weft::testing

#include "core/cloth_contact/gradients.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <limits>
#include <vector>

#include "core/triangles/cut.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/triangle_meshes.h"

namespace weft::testing {
namespace {

using Gradient = Eigen::Matrix<float, 3, 2>;

// Solved for, not by an inverse.
Gradient gradient(const Cloth& cloth, int triangle, const Matrix3Xd& x) {
  const auto t = static_cast<std::size_t>(triangle);
  const auto& [i, j, k] = cloth.triangles[t];
  const auto& flat = cloth.flat[t];
  Eigen::Matrix2d sides;
  sides << flat[1] - flat[0], flat[2] - flat[0];
  Eigen::Matrix<double, 3, 2> ways;
  ways << x.col(j) - x.col(i), x.col(k) - x.col(i);
  return sides.transpose().colPivHouseholderQr().solve(ways.transpose()).transpose().cast<float>();
}

void expect_those_of_every_triangle(const Cloth& cloth) {
  constexpr float kRounding = 1e-4F;
  const Matrix3Xd x = noise(cloth.particles());
  Eigen::Matrix4Xf places = Eigen::Matrix4Xf::Zero(4, x.cols());
  places.topRows<3>() = x.cast<float>();
  const Gradient ways = noise(2).cast<float>();
  Gradients gradients(cloth);
  const int blocks = static_cast<int>(cloth.first_block.size()) - 1;
  std::vector<int> some;
  Eigen::Array22f low, high;
  for (int b = 0; b < blocks; ++b) {
    gradients.set(b, places);
    if (some.size() == 3) some.clear();
    some.push_back(b);
    if (some.size() == 1) {
      low.setConstant(std::numeric_limits<float>::infinity());
      high = -low;
    }
    Gradient sum = Gradient::Zero();
    for (int t = cloth.first_block[static_cast<std::size_t>(b)];
         t < cloth.first_block[static_cast<std::size_t>(b) + 1]; ++t) {
      const Gradient each = gradient(cloth, t, x);
      sum += each;
      const Eigen::Array22f along = (ways.transpose() * each).array();
      low = low.min(along);
      high = high.max(along);
    }
    const float size = kRounding * sum.norm() + kRounding * (high - low).matrix().norm();
    EXPECT_LT((gradients.sum(b) - sum).norm(), size);
    const Gradients::Bounds found = gradients.along(ways, some);
    EXPECT_LT((found.low - low).abs().maxCoeff(), size);
    EXPECT_LT((found.high - high).abs().maxCoeff(), size);
  }
  EXPECT_GT(blocks, 3);
}

TEST(Gradients, AreThoseOfEveryTriangleInVectorsOfAnyWidth) {
  SheetDefinition disc = flat_sheet(2, 2);
  disc.shape = complete(triangle_mesh(cut_disc(Cut::kAlternating, 0.08, 0.01)));
  const Cloth cloth({flat_sheet(17, 12, 0.01), disc});
  for (const std::int64_t target : {HWY_STATIC_TARGET, HWY_AVX2, HWY_AVX3}) {
    if ((hwy::SupportedTargets() & target) == 0) continue;
    SCOPED_TRACE(hwy::TargetName(target));
    hwy::SetSupportedTargetsForTest(target);
    expect_those_of_every_triangle(cloth);
    hwy::SetSupportedTargetsForTest(0);
  }
}

}  // namespace
}  // namespace weft::testing

#include "core/cloth_contact/pair_batch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/contact/nearest.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

// Points about the origin; of some pairs two fall together, or lie on a line.
Matrix3Xd points_of_pairs(int pairs) {
  Matrix3Xd x = noise(4 * pairs, 3);
  for (int k = 0; k < pairs; ++k) {
    if (k % 7 == 3) x.col(4 * k + 2) = x.col(4 * k + 1);
    if (k % 7 == 5) x.col(4 * k + 3) = x.col(4 * k + 2) + 0.5 * (x.col(4 * k + 1) - x.col(4 * k));
    if (k % 7 == 6) x.col(4 * k + 3) = 2 * x.col(4 * k + 2) - x.col(4 * k + 1);
  }
  return x;
}

// Of all pairs the greatest distance between ways that the batch and the plain function find; where
// several are shortest, lengths count.
template <class Plain>
double difference(std::size_t size, bool edges, const Plain& plain) {
  const Matrix3Xd x = points_of_pairs(static_cast<int>(size));
  PairBatch batch(edges, x);
  for (int k = 0; k < x.cols(); k += 4) batch.add({k, k + 1, k + 2, k + 3});
  batch.solve();
  double most = 0;
  for (std::size_t k = 0; k < size; ++k) {
    const Eigen::Index at = 4 * static_cast<Eigen::Index>(k);
    const std::array<double, 4> weight = batch.weights(k);
    const Vector3d apart = weight[0] * x.col(at) + weight[1] * x.col(at + 1) +
                           weight[2] * x.col(at + 2) + weight[3] * x.col(at + 3);
    most = std::max({most, (apart - batch.apart(k)).norm(),
                     std::abs(apart.squaredNorm() - batch.squared(k)),
                     std::abs(apart.norm() - plain(x, at))});
  }
  return most;
}

TEST(PairBatch, FindsTheNearestPointsThatThePlainFunctionsFind) {
  for (const std::size_t size : {std::size_t{1}, std::size_t{5}, PairBatch::kMost}) {
    EXPECT_LT(difference(size, false,
                         [](const Matrix3Xd& x, Eigen::Index at) {
                           const Vector3d p = x.col(at), a = x.col(at + 1), b = x.col(at + 2),
                                          c = x.col(at + 3);
                           const auto [u, v, w] = nearest_in_triangle(p, a, b, c);
                           return (p - u * a - v * b - w * c).norm();
                         }),
              1e-12);
    EXPECT_LT(difference(size, true,
                         [](const Matrix3Xd& x, Eigen::Index at) {
                           const Vector3d a = x.col(at), b = x.col(at + 1), c = x.col(at + 2),
                                          d = x.col(at + 3);
                           const auto [s, t] = nearest_on_edges(a, b, c, d);
                           return (a + s * (b - a) - c - t * (d - c)).norm();
                         }),
              1e-12);
  }
}

TEST(PairBatch, FindsWhatMayHaveComeNearerThanItsThickness) {
  const auto size = static_cast<int>(PairBatch::kMost);
  const Matrix3Xd x = points_of_pairs(size), ways = 0.3 * noise(4 * size, 5),
                  steps = noise(4 * size, 7);
  std::vector<Mover> movers;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    Mover& mover = movers.emplace_back();
    mover.way << ways.col(i), 0;
    mover.in_step << steps.col(i), 0;
  }
  constexpr double kThickness = 0.1;
  const auto come = [](int pair) { return 0.1 * (pair % 8); };
  for (const bool edges : {false, true}) {
    PairBatch batch(edges, x);
    for (int k = 0; k < size; ++k)
      batch.add({4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3}, kThickness, come(k));
    batch.solve();
    batch.find_met(movers);
    // of all particles of the one side to all of the other
    const auto farthest = [&](const Matrix3Xd& motion, std::size_t pair) {
      const Eigen::Index first = 4 * static_cast<Eigen::Index>(pair), ends = edges ? 2 : 1;
      double most = 0;
      for (Eigen::Index i = first; i < first + ends; ++i)
        for (Eigen::Index j = first + ends; j < first + 4; ++j)
          most = std::max(most, (motion.col(i) - motion.col(j)).squaredNorm());
      return most;
    };
    std::vector<std::size_t> met, wanted;
    for (std::size_t n = 0; n < batch.met_size(); ++n) {
      met.push_back(batch.met(n));
      EXPECT_NEAR(batch.squared_in_step(n), farthest(steps, batch.met(n)), 1e-15);
    }
    int near = 0;
    for (std::size_t k = 0; k < batch.size(); ++k) {
      const double distance = std::sqrt(batch.squared(k)), room = distance - kThickness;
      if (distance == 0 || room >= come(static_cast<int>(k))) continue;
      ++near;
      if (room <= std::sqrt(farthest(ways, k))) wanted.push_back(k);
    }
    EXPECT_EQ(met, wanted);
    EXPECT_GT(met.size(), 0);
    EXPECT_LT(met.size(), near);
    EXPECT_LT(near, batch.size());
  }
}

}  // namespace
}  // namespace weft::testing

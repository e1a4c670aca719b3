#include "core/cloth_contact/pair_batch.h"

#include <gtest/gtest.h>

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
template <class Solve, class Plain>
double difference(std::size_t size, const Solve& solve, const Plain& plain) {
  const Matrix3Xd x = points_of_pairs(static_cast<int>(size));
  PairBatch batch;
  for (Eigen::Index k = 0; k < x.cols(); k += 4)
    batch.add(x.col(k), x.col(k + 1), x.col(k + 2), x.col(k + 3));
  solve(batch);
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
    EXPECT_LT(difference(
                  size, [](PairBatch& batch) { batch.solve_corners(); },
                  [](const Matrix3Xd& x, Eigen::Index at) {
                    const Vector3d p = x.col(at), a = x.col(at + 1), b = x.col(at + 2),
                                   c = x.col(at + 3);
                    const auto [u, v, w] = nearest_in_triangle(p, a, b, c);
                    return (p - u * a - v * b - w * c).norm();
                  }),
              1e-12);
    EXPECT_LT(difference(
                  size, [](PairBatch& batch) { batch.solve_edges(); },
                  [](const Matrix3Xd& x, Eigen::Index at) {
                    const Vector3d a = x.col(at), b = x.col(at + 1), c = x.col(at + 2),
                                   d = x.col(at + 3);
                    const auto [s, t] = nearest_on_edges(a, b, c, d);
                    return (a + s * (b - a) - c - t * (d - c)).norm();
                  }),
              1e-12);
  }
}

}  // namespace
}  // namespace weft::testing

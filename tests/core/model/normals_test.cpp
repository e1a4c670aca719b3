#include "core/model/normals.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

namespace weft::testing {
namespace {

// A sheet of n x n on a half cylinder of radius 0.5 m along z, and the largest angle, rad, between
// its normals and the cylinder's, within the edges and on them.
std::pair<double, double> errors_on_a_cylinder(int n) {
  const auto particles = static_cast<std::size_t>(n * n);
  std::vector<double> x(3 * particles);
  const auto angle = [&](int column) { return M_PI * column / (n - 1); };
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      const auto i = static_cast<std::size_t>(row * n + column);
      x[i] = -0.5 * std::cos(angle(column));
      x[particles + i] = 0.5 * std::sin(angle(column));
      x[2 * particles + i] = 0.03 * row;
    }
  }
  const auto normals = normals_of(x, {Grid{.rows = n, .columns = n}});
  double within = 0, edge = 0;
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      const auto i = static_cast<std::size_t>(row * n + column);
      const Eigen::Vector3d found(normals[i], normals[particles + i], normals[2 * particles + i]);
      const Eigen::Vector3d inwards(std::cos(angle(column)), -std::sin(angle(column)), 0);
      EXPECT_NEAR(found.norm(), 1, 1e-15);
      const double error = std::atan2(found.cross(inwards).norm(), found.dot(inwards));
      double& largest = column == 0 || column == n - 1 ? edge : within;
      largest = std::max(largest, error);
    }
  }
  return {within, edge};
}

TEST(Normals, OfACylinderAreItsOwnButForHalfACellAtItsEdges) {
  const auto [within, edge] = errors_on_a_cylinder(31);
  EXPECT_LT(within, 1e-14);
  EXPECT_NEAR(edge, M_PI / 60, 1e-14);
}

TEST(Normals, AreZeroWhereTheClothHasNoArea) {
  std::vector<double> x(12, 0);  // 2 x 2, all in one point
  EXPECT_EQ(normals_of(x, {Grid{.rows = 2, .columns = 2}}), std::vector<double>(12, 0));
  x = {0, 1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0};  // in line
  EXPECT_EQ(normals_of(x, {Grid{.rows = 2, .columns = 2}}), std::vector<double>(12, 0));
}

}  // namespace
}  // namespace weft::testing

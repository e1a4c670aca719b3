#include "core/model/strain.h"

#include <Eigen/LU>
#include <cmath>

namespace weft {
namespace {

using Sides = Eigen::Matrix2d;  // of a triangle from its first corner, in columns, along warp, weft

// A grid's triangles have their first corner at a right angle, the second along a column or back.
Sides flat_sides(const Grid& grid, std::size_t triangle) {
  const double h = triangle % 2 == 0 ? grid.spacing : -grid.spacing;
  Sides sides;
  sides << 0, h, h, 0;
  return sides;
}

Sides flat_sides(const TriangleMesh& mesh, std::size_t triangle, double grain) {
  Eigen::Matrix2d turn;  // (u, v) to (warp, weft), see rest_shape()
  turn << -std::sin(grain), std::cos(grain), -std::cos(grain), -std::sin(grain);
  Sides sides;
  for (std::size_t k = 1; k < 3; ++k)
    sides.col(static_cast<Eigen::Index>(k) - 1) =
        turn * (flat_corner(mesh, triangle, k) - flat_corner(mesh, triangle, 0));
  return sides;
}

class Planes {
 public:
  Planes(const std::vector<double>& positions, std::size_t triangles)
      : positions_(positions.data(), static_cast<Eigen::Index>(positions.size() / 3), 3),
        values_(3 * triangles),
        triangles_(triangles) {}

  void add(const std::array<int, 3>& triangle, int first_particle, const Sides& flat) {
    Eigen::Matrix<double, 3, 2> sides;
    for (std::size_t k = 1; k < 3; ++k)
      sides.col(static_cast<Eigen::Index>(k) - 1) = positions_.row(first_particle + triangle[k]) -
                                                    positions_.row(first_particle + triangle[0]);
    const Eigen::Matrix<double, 3, 2> threads = sides * flat.inverse();
    const double warp = threads.col(0).norm(), weft = threads.col(1).norm();
    const double both = warp * weft;
    values_[next_] = warp - 1;
    values_[next_ + triangles_] = weft - 1;
    values_[next_ + 2 * triangles_] = both > 0 ? threads.col(0).dot(threads.col(1)) / both : 0;
    ++next_;
  }
  std::vector<double> take() { return std::move(values_); }

 private:
  Eigen::Map<const Eigen::MatrixX3d> positions_;
  std::vector<double> values_;
  std::size_t triangles_, next_ = 0;
};

}  // namespace

std::vector<double> strains_of(const std::vector<double>& positions,
                               const std::vector<SheetShape>& sheets) {
  std::size_t count = 0;
  for (const SheetShape& sheet : sheets) count += static_cast<std::size_t>(triangle_count(sheet));
  Planes planes(positions, count);
  int first = 0;
  for (const SheetShape& sheet : sheets) {
    const auto triangles = triangles_of(sheet);
    if (const auto* grid = std::get_if<Grid>(&sheet)) {
      for (std::size_t t = 0; t < triangles.size(); ++t)
        planes.add(triangles[t], first, flat_sides(*grid, t));
    } else {
      const TriangleMesh& mesh = *std::get<Triangles>(sheet);
      std::size_t t = 0;
      for (const Panel& panel : mesh.panels)
        for (int n = 0; n < panel.triangles; ++n, ++t)
          planes.add(triangles[t], first, flat_sides(mesh, t, panel.grain));
    }
    first += particle_count(sheet);
  }
  return planes.take();
}

}  // namespace weft

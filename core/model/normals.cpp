#include "core/model/normals.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace weft {

std::vector<double> normals_of(const std::vector<double>& positions,
                               const std::vector<Grid>& sheets) {
  const auto particles = static_cast<Eigen::Index>(positions.size() / 3);
  const Eigen::Map<const Eigen::MatrixX3d> x(positions.data(), particles, 3);
  std::vector<double> normals(positions.size());
  Eigen::Map<Eigen::MatrixX3d> to(normals.data(), particles, 3);
  Eigen::Index first = 0;
  for (const Grid& sheet : sheets) {
    const auto at = [&](int row, int column) {
      return x.row(first + Eigen::Index{row} * sheet.columns + column);
    };
    for (int row = 0; row < sheet.rows; ++row) {
      const int above = std::max(row - 1, 0), below = std::min(row + 1, sheet.rows - 1);
      for (int column = 0; column < sheet.columns; ++column) {
        const int left = std::max(column - 1, 0), right = std::min(column + 1, sheet.columns - 1);
        const Eigen::Vector3d along = at(row, right) - at(row, left);
        const Eigen::Vector3d down = at(below, column) - at(above, column);
        to.row(first + Eigen::Index{row} * sheet.columns + column) = along.cross(down).normalized();
      }
    }
    first += Eigen::Index{sheet.rows} * sheet.columns;
  }
  return normals;
}

}  // namespace weft

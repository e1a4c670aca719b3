#include "core/model/normals.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace weft {
namespace {

using ConstPlanes = Eigen::Map<const Eigen::MatrixX3d>;
using Planes = Eigen::Map<Eigen::MatrixX3d>;

void set_normals(const Grid& sheet, const ConstPlanes& x, Eigen::Index first, Planes& normals) {
  const auto index = [&](int row, int column) {
    return first + Eigen::Index{row} * sheet.columns + column;
  };
  for (int row = 0; row < sheet.rows; ++row) {
    const int above = std::max(row - 1, 0), below = std::min(row + 1, sheet.rows - 1);
    for (int column = 0; column < sheet.columns; ++column) {
      const int left = std::max(column - 1, 0), right = std::min(column + 1, sheet.columns - 1);
      const Eigen::Vector3d along = x.row(index(row, right)) - x.row(index(row, left));
      const Eigen::Vector3d down = x.row(index(below, column)) - x.row(index(above, column));
      normals.row(index(row, column)) = along.cross(down).normalized();
    }
  }
}

}  // namespace

std::vector<double> normals_of(const std::vector<double>& positions,
                               const std::vector<SheetShape>& sheets) {
  const auto particles = static_cast<Eigen::Index>(positions.size() / 3);
  const ConstPlanes x(positions.data(), particles, 3);
  std::vector<double> values(positions.size());
  Planes normals(values.data(), particles, 3);
  Eigen::Index first = 0;
  for (const SheetShape& sheet : sheets) {
    std::visit([&](const auto& shape) { set_normals(shape, x, first, normals); }, sheet);
    first += particle_count(sheet);
  }
  return values;
}

}  // namespace weft

#include "core/model/normals.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace weft {
namespace {

using ConstPlanes = Eigen::Map<const Eigen::MatrixX3d>;
using NormalPlanes = Eigen::Map<Eigen::MatrixX3d>;

void set_normals(const Grid& sheet, const ConstPlanes& x, Eigen::Index first,
                 NormalPlanes& normals) {
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

// Weighted by area, as cross products are.
void set_normals(const Triangles& sheet, const ConstPlanes& x, Eigen::Index first,
                 NormalPlanes& normals) {
  const auto particles = static_cast<Eigen::Index>(sheet->start.size());
  normals.middleRows(first, particles).setZero();
  for (const auto& [a, b, c] : sheet->triangles) {
    const Eigen::Vector3d along = x.row(first + b) - x.row(first + a);
    const Eigen::Vector3d across = x.row(first + c) - x.row(first + a);
    const Eigen::RowVector3d normal = along.cross(across);
    for (const int i : {a, b, c}) normals.row(first + i) += normal;
  }
  for (Eigen::Index i = first; i < first + particles; ++i) normals.row(i).normalize();
}

}  // namespace

std::vector<double> normals_of(const std::vector<double>& positions,
                               const std::vector<SheetShape>& sheets) {
  const auto particles = static_cast<Eigen::Index>(positions.size() / 3);
  const ConstPlanes x(positions.data(), particles, 3);
  std::vector<double> values(positions.size());
  NormalPlanes normals(values.data(), particles, 3);
  Eigen::Index first = 0;
  for (const SheetShape& sheet : sheets) {
    std::visit([&](const auto& shape) { set_normals(shape, x, first, normals); }, sheet);
    first += particle_count(sheet);
  }
  return values;
}

}  // namespace weft

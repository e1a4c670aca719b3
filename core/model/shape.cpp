#include "core/model/shape.h"

namespace weft {

int particle_count(const SheetShape& shape) {
  const Grid& grid = std::get<Grid>(shape);
  return grid.rows * grid.columns;
}

double spacing(const SheetShape& shape) { return std::get<Grid>(shape).spacing; }

Extent extent(const SheetShape& shape) {
  const Grid& grid = std::get<Grid>(shape);
  return {static_cast<double>(grid.columns - 1), static_cast<double>(grid.rows - 1)};
}

Vector3d flat_position(const SheetShape& shape, int particle) {
  const Grid& grid = std::get<Grid>(shape);
  const int r = particle / grid.columns, c = particle % grid.columns;
  return {c * grid.spacing, 0, r * grid.spacing};
}

}  // namespace weft

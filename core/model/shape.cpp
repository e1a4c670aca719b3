#include "core/model/shape.h"

namespace weft {
namespace {

int particle_count_of(const Grid& grid) { return grid.rows * grid.columns; }
double spacing_of(const Grid& grid) { return grid.spacing; }
Extent extent_of(const Grid& grid) {
  return {static_cast<double>(grid.columns - 1), static_cast<double>(grid.rows - 1)};
}
Vector3d flat_position_of(const Grid& grid, int particle) {
  const int r = particle / grid.columns, c = particle % grid.columns;
  return {c * grid.spacing, 0, r * grid.spacing};
}

}  // namespace

int particle_count(const SheetShape& shape) {
  return std::visit([](const auto& each) { return particle_count_of(each); }, shape);
}

double spacing(const SheetShape& shape) {
  return std::visit([](const auto& each) { return spacing_of(each); }, shape);
}

Extent extent(const SheetShape& shape) {
  return std::visit([](const auto& each) { return extent_of(each); }, shape);
}

Vector3d flat_position(const SheetShape& shape, int particle) {
  return std::visit([&](const auto& each) { return flat_position_of(each, particle); }, shape);
}

}  // namespace weft

#pragma once

#include <Eigen/Core>
#include <variant>

namespace weft {

using Eigen::Vector3d;

// rows x columns particles; particle (r, c) has index r * columns + c and lies at (c h, 0, r h).
struct Grid {
  int rows = 2;
  int columns = 2;
  double spacing = 0;  // h, m
};

// What a sheet is cut as. Whoever needs to know more of it than the functions below tell belongs to
// the folder of its kind.
using SheetShape = std::variant<Grid>;

int particle_count(const SheetShape& shape);

// Between neighbours: the length by which a sheet's own lengths are judged, m.
double spacing(const SheetShape& shape);

// Along warp and weft, in spacings.
struct Extent {
  double warp = 0, weft = 0;
};
Extent extent(const SheetShape& shape);

// Of a particle in the flat sheet, from particle 0, m.
Vector3d flat_position(const SheetShape& shape, int particle);

}  // namespace weft

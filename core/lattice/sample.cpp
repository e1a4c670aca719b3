#include "core/lattice/sample.h"

#include <algorithm>

namespace weft {
namespace {

constexpr int kSide = 96;  // of a window, in particles

bool has_as_many(const SheetShape& shape, int particles) {
  const auto* grid = std::get_if<Grid>(&shape);
  return grid != nullptr && grid->rows * grid->columns >= particles;
}

}  // namespace

bool is_large(const SheetShape& shape) { return has_as_many(shape, 512 * 512); }
bool is_sampled(const SheetShape& shape) { return has_as_many(shape, 128 * 128); }

LatticeSample sample_of(const Grid& grid, const Mesh& mesh, int particle) {
  const auto first = [](int middle, int all) {
    return std::clamp(middle - kSide / 2, 0, std::max(0, all - kSide));
  };
  const int rows = std::min(kSide, grid.rows), columns = std::min(kSide, grid.columns);
  const int top = first(particle / grid.columns, grid.rows);
  const int left = first(particle % grid.columns, grid.columns);
  const auto place = [&](int i) {
    const int row = i / grid.columns - top, column = i % grid.columns - left;
    const bool inside = row >= 0 && row < rows && column >= 0 && column < columns;
    return inside ? row * columns + column : -1;
  };

  LatticeSample sample;
  for (int i = 0; i < rows * columns; ++i)
    sample.particles.push_back((top + i / columns) * grid.columns + left + i % columns);
  sample.mesh.damping = mesh.damping;
  sample.mesh.mass = mesh.mass(sample.particles);
  if (mesh.drag.size() > 0) sample.mesh.drag = mesh.drag(sample.particles);
  for (const Family& family : mesh.families) {
    Family& made = sample.mesh.families.emplace_back(family);
    made.connections = {};
    for (const auto& [i, j] : family.connections)
      if (const int from = place(i), to = place(j); from >= 0 && to >= 0)
        made.connections.add(from, to);
  }
  for (Stencil stencil : mesh.stencils) {
    bool inside = true;
    for (int& i : stencil.particle) inside = (i = place(i)) >= 0 && inside;
    if (inside) sample.mesh.stencils.push_back(stencil);
  }
  return sample;
}

int tautest_particle(const Mesh& mesh, const Matrix3Xd& x) {
  int tautest = 0;
  double most = 0;
  for (const Family& family : mesh.families) {
    if (family.bend) continue;
    for (const auto& [i, j] : family.connections) {
      const double strain = (x.col(j) - x.col(i)).norm() / family.rest_length;
      if (strain <= most) continue;
      most = strain;
      tautest = i;
    }
  }
  return tautest;
}

}  // namespace weft

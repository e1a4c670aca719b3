#include "core/model/shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace weft {
namespace {

int particle_count_of(const Grid& grid) { return grid.rows * grid.columns; }
double spacing_of(const Grid& grid) { return grid.spacing; }
double shortest_edge_of(const Grid& grid) { return grid.spacing; }
Extent extent_of(const Grid& grid) {
  return {static_cast<double>(grid.columns - 1), static_cast<double>(grid.rows - 1)};
}
Vector3d local_position_of(const Grid& grid, int particle) {
  const int r = particle / grid.columns, c = particle % grid.columns;
  return {c * grid.spacing, 0, r * grid.spacing};
}
int triangle_count_of(const Grid& grid) { return 2 * (grid.rows - 1) * (grid.columns - 1); }
std::vector<std::array<int, 3>> triangles_in(const Grid& grid) {
  std::vector<std::array<int, 3>> triangles;
  triangles.reserve(static_cast<std::size_t>(triangle_count_of(grid)));
  for (int r = 0; r + 1 < grid.rows; ++r) {
    for (int c = 0; c + 1 < grid.columns; ++c) {
      const int i = r * grid.columns + c, below = i + grid.columns;
      triangles.push_back({i, below, i + 1});
      triangles.push_back({below + 1, i + 1, below});
    }
  }
  return triangles;
}

Grid shown_grid(const Grid& grid) {
  const int every = grid.simulated_every;
  return {(grid.rows - 1) * every + 1, (grid.columns - 1) * every + 1, grid.shown_spacing};
}

int particle_count_of(const Triangles& mesh) { return static_cast<int>(mesh->start.size()); }
double spacing_of(const Triangles& mesh) { return mesh->spacing; }
double shortest_edge_of(const Triangles& mesh) {
  double shortest = std::numeric_limits<double>::infinity();
  for (std::size_t t = 0; t < mesh->triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      shortest = std::min(shortest,
                          (flat_corner(*mesh, t, (k + 1) % 3) - flat_corner(*mesh, t, k)).norm());
  return shortest;
}
Extent extent_of(const Triangles& mesh) {
  return {mesh->size.x() / mesh->spacing, mesh->size.y() / mesh->spacing};
}
Vector3d local_position_of(const Triangles& mesh, int particle) {
  return mesh->start[static_cast<std::size_t>(particle)];
}
int triangle_count_of(const Triangles& mesh) { return static_cast<int>(mesh->triangles.size()); }
std::vector<std::array<int, 3>> triangles_in(const Triangles& mesh) { return mesh->triangles; }

// Whether indices lie within their arrays.
bool is_sound(const TriangleMesh& mesh) {
  const auto within = [](const auto& triangles, std::size_t most) {
    return std::all_of(triangles.begin(), triangles.end(), [&](const auto& triangle) {
      return std::all_of(triangle.begin(), triangle.end(),
                         [&](int i) { return i >= 0 && static_cast<std::size_t>(i) < most; });
    });
  };
  const bool own = mesh.flat_triangles.empty();
  if (mesh.triangles.empty() || !within(mesh.triangles, mesh.start.size())) return false;
  return own ? mesh.flat.size() == mesh.start.size()
             : mesh.flat_triangles.size() == mesh.triangles.size() &&
                   within(mesh.flat_triangles, mesh.flat.size());
}

double median_edge(const TriangleMesh& mesh) {
  std::vector<double> lengths;
  lengths.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      lengths.push_back((flat_corner(mesh, t, (k + 1) % 3) - flat_corner(mesh, t, k)).norm());
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

// Of the largest panel along warp and weft.
Vector2d largest_size(const TriangleMesh& mesh) {
  Vector2d largest = Vector2d::Zero();
  std::size_t t = 0;
  for (const Panel& panel : mesh.panels) {
    const Vector2d warp(-std::sin(panel.grain), std::cos(panel.grain)), weft(warp.y(), -warp.x());
    Vector2d least = Vector2d::Constant(INFINITY), most = -least;
    for (int n = 0; n < panel.triangles && t < mesh.triangles.size(); ++n, ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector2d& corner = flat_corner(mesh, t, k);
        const Vector2d at(corner.dot(warp), corner.dot(weft));
        least = least.cwiseMin(at);
        most = most.cwiseMax(at);
      }
    if (panel.triangles > 0) largest = largest.cwiseMax(most - least);
  }
  return largest;
}

}  // namespace

Triangles complete(TriangleMesh mesh) {
  if (mesh.flat.empty() && mesh.flat_triangles.empty())
    for (const Vector3d& x : mesh.start) mesh.flat.emplace_back(x.z(), x.x());
  if (mesh.start.empty() && mesh.flat_triangles.empty())
    for (const Vector2d& corner : mesh.flat) mesh.start.emplace_back(corner.y(), 0, corner.x());
  mesh.start.shrink_to_fit();
  mesh.flat.shrink_to_fit();
  mesh.triangles.shrink_to_fit();
  mesh.flat_triangles.shrink_to_fit();
  if (mesh.panels.empty())
    mesh.panels.push_back({"panel", static_cast<int>(mesh.triangles.size()), 0});
  if (is_sound(mesh)) {
    mesh.spacing = median_edge(mesh);
    mesh.size = largest_size(mesh);
  }
  return std::make_shared<const TriangleMesh>(std::move(mesh));
}

int particle_count(const SheetShape& shape) {
  return std::visit([](const auto& each) { return particle_count_of(each); }, shape);
}

std::vector<std::array<int, 3>> triangles_of(const SheetShape& shape) {
  return std::visit([](const auto& each) { return triangles_in(each); }, shape);
}

int triangle_count(const SheetShape& shape) {
  return std::visit([](const auto& each) { return triangle_count_of(each); }, shape);
}

double spacing(const SheetShape& shape) {
  return std::visit([](const auto& each) { return spacing_of(each); }, shape);
}

double shortest_edge(const SheetShape& shape) {
  return std::visit([](const auto& each) { return shortest_edge_of(each); }, shape);
}

bool is_interpolated(const SheetShape& shape) {
  const auto* grid = std::get_if<Grid>(&shape);
  return grid != nullptr && grid->simulated_every > 1;
}

SheetShape shown(const SheetShape& shape) {
  return is_interpolated(shape) ? shown_grid(std::get<Grid>(shape)) : shape;
}

int shown_particle(const SheetShape& shape, int simulated) {
  if (!is_interpolated(shape)) return simulated;
  const Grid& grid = std::get<Grid>(shape);
  const int row = simulated / grid.columns, column = simulated % grid.columns;
  return (row * shown_grid(grid).columns + column) * grid.simulated_every;
}

std::optional<int> simulated_particle(const SheetShape& shape, int shown) {
  if (!is_interpolated(shape)) return shown;
  const Grid& grid = std::get<Grid>(shape);
  const int every = grid.simulated_every, columns = shown_grid(grid).columns;
  const int row = shown / columns, column = shown % columns;
  if (row % every != 0 || column % every != 0) return std::nullopt;
  return row / every * grid.columns + column / every;
}

Extent extent(const SheetShape& shape) {
  return std::visit([](const auto& each) { return extent_of(each); }, shape);
}

Vector3d local_position(const SheetShape& shape, int particle) {
  return std::visit([&](const auto& each) { return local_position_of(each, particle); }, shape);
}

}  // namespace weft

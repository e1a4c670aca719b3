#include "tests/support/core/triangle_meshes.h"

#include <cmath>
#include <random>

namespace weft::testing {

RestShape rest_shape(const std::vector<Vector2d>& points,
                     const std::vector<std::array<int, 3>>& triangles) {
  RestShape shape;
  shape.particles = static_cast<int>(points.size());
  shape.triangles = triangles;
  for (const auto& triangle : triangles) {
    auto& corners = shape.corners.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) corners[k] = points[static_cast<std::size_t>(triangle[k])];
  }
  return shape;
}

std::vector<Vector2d> points_of(const RestShape& shape) {
  std::vector<Vector2d> points(static_cast<std::size_t>(shape.particles));
  for (std::size_t t = shape.triangles.size(); t-- > 0;)
    for (std::size_t k = 0; k < 3; ++k)
      points[static_cast<std::size_t>(shape.triangles[t][k])] = shape.corners[t][k];
  return points;
}

RestShape square(Cut cut, double width, double spacing) {
  const bool equilateral = cut == Cut::kEquilateral;
  const double height = equilateral ? spacing * std::sqrt(0.75) : spacing;
  const int columns = static_cast<int>(std::lround(width / spacing)) + 1;
  const int rows = static_cast<int>(std::lround(width / height)) + 1;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> jitter(-0.25 * spacing, 0.25 * spacing);
  std::vector<Vector2d> points;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      Vector2d& point = points.emplace_back(c * spacing, r * height);
      if (equilateral && r % 2 == 1) point.x() += spacing / 2;
      if (cut != Cut::kIrregular) continue;
      if (c > 0 && c + 1 < columns) point.x() += jitter(random);
      if (r > 0 && r + 1 < rows) point.y() += jitter(random);
    }
  std::vector<std::array<int, 3>> triangles;
  for (int r = 0; r + 1 < rows; ++r)
    for (int c = 0; c + 1 < columns; ++c) {
      const int a = r * columns + c, b = a + 1, d = a + columns, e = d + 1;
      const bool rising = cut == Cut::kRight || (equilateral ? r % 2 == 1 : (r + c) % 2 == 0);
      if (rising) {
        triangles.push_back({a, b, e});
        triangles.push_back({a, e, d});
      } else {
        triangles.push_back({a, b, d});
        triangles.push_back({b, e, d});
      }
    }
  return rest_shape(points, triangles);
}

TriangleMesh triangle_mesh(const RestShape& shape) {
  TriangleMesh mesh;
  // with the warp along the v axis
  for (const Vector2d& point : points_of(shape)) {
    mesh.flat.emplace_back(-point.y(), point.x());
    mesh.start.emplace_back(point.x(), 0, point.y());
  }
  mesh.triangles = shape.triangles;
  return mesh;
}

}  // namespace weft::testing

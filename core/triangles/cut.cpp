#include "core/triangles/cut.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

namespace weft {
namespace {

using Triangle = std::array<int, 3>;

constexpr double kJitter = 0.3;  // of a spacing

class Jitter {
 public:
  explicit Jitter(double most) : most_(most) {}
  double operator()() { return most_ * (2 * (static_cast<double>(random_()) * 0x1p-32) - 1); }

 private:
  std::mt19937 random_{3};
  double most_;
};

const Vector2d& at(const std::vector<Vector2d>& points, int i) {
  return points[static_cast<std::size_t>(i)];
}

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - b.x() * a.y(); }

// Sine of the least angle of a triangle; below 0 where it runs clockwise.
double least_sine(const std::vector<Vector2d>& points, const Triangle& t) {
  const Vector2d a = at(points, t[1]) - at(points, t[0]), b = at(points, t[2]) - at(points, t[1]),
                 c = at(points, t[0]) - at(points, t[2]);
  const double twice = cross(a, b), ab = a.norm() * b.norm(), bc = b.norm() * c.norm(),
               ca = c.norm() * a.norm();
  return twice / std::max({ab, bc, ca});
}

// Columns of a rectangle of equilateral triangles; every other one begins and ends with half an
// edge.
RestShape equilateral_rectangle(double length, double width, int columns, int rows) {
  std::vector<Vector2d> points;
  std::vector<int> first;  // of each column
  const double spacing = width / rows, height = length / columns;
  for (int c = 0; c <= columns; ++c) {
    first.push_back(static_cast<int>(points.size()));
    if (c % 2 == 0) {
      for (int r = 0; r <= rows; ++r) points.emplace_back(c * height, r * spacing);
    } else {
      points.emplace_back(c * height, 0);
      for (int r = 0; r < rows; ++r) points.emplace_back(c * height, (r + 0.5) * spacing);
      points.emplace_back(c * height, width);
    }
  }
  std::vector<Triangle> triangles;
  for (int c = 0; c < columns; ++c) {
    const bool even_before = c % 2 == 0;
    const auto column = static_cast<std::size_t>(c);
    const int even = first[even_before ? column : column + 1];
    const int odd = first[even_before ? column + 1 : column];
    const auto add = [&](int a, int b, int d) {
      triangles.push_back(even_before ? Triangle{a, b, d} : Triangle{a, d, b});
    };
    for (int r = 0; r <= rows; ++r) {
      add(even + r, odd + r, odd + r + 1);
      if (r < rows) add(even + r, odd + r + 1, even + r + 1);
    }
  }
  return rest_shape(points, triangles);
}

// Lower hull of points lifted to `height`: of |p|^2 Delaunay's triangulation, else one that prefers
// edges between low points. Each point in turn takes the place of the triangles that it lies below
// (Bowyer 1981, Watson 1981).
std::vector<Triangle> lower_hull(std::vector<Vector2d> points, std::vector<double> height) {
  const int count = static_cast<int>(points.size());
  double reach = 0;
  for (const Vector2d& point : points) reach = std::max(reach, point.norm());
  reach *= 1000;
  for (const Vector2d& far : {Vector2d(-2, -1), Vector2d(2, -1), Vector2d(0, 2)}) {
    points.emplace_back(reach * far);
    height.push_back(points.back().squaredNorm());
  }
  std::vector<Triangle> triangles = {{count, count + 1, count + 2}};
  for (int i = 0; i < count; ++i) {
    const auto below = [&](const Triangle& triangle) {
      Eigen::Matrix3d lifted;
      for (int k = 0; k < 3; ++k) {
        const int j = triangle[static_cast<std::size_t>(k)];
        lifted.row(k) << (at(points, j) - at(points, i)).transpose(),
            height[static_cast<std::size_t>(j)] - height[static_cast<std::size_t>(i)];
      }
      return lifted.determinant() > 0;
    };
    std::map<Connection, Connection> open;  // edges of what is taken away, by the undirected ones
    std::erase_if(triangles, [&](const Triangle& triangle) {
      if (!below(triangle)) return false;
      for (std::size_t k = 0; k < 3; ++k) {
        const Connection edge(triangle[k], triangle[(k + 1) % 3]);
        const auto [known, fresh] = open.emplace(std::minmax(edge.first, edge.second), edge);
        if (!fresh) open.erase(known);
      }
      return true;
    });
    for (const auto& [undirected, edge] : open) triangles.push_back({edge.first, edge.second, i});
  }
  std::erase_if(triangles, [&](const Triangle& triangle) {
    return *std::max_element(triangle.begin(), triangle.end()) >= count;
  });
  return triangles;
}

}  // namespace

double column_step(Cut cut) { return cut == Cut::kEquilateral ? std::sqrt(0.75) : 1; }

RestShape cut_rectangle(Cut cut, double length, double width, double spacing) {
  const auto steps = [&](double size, double step) {
    return std::max(1, static_cast<int>(std::lround(size / step)));
  };
  const int columns = steps(length, column_step(cut) * spacing);
  const int rows = steps(width, spacing);
  if (cut == Cut::kEquilateral) return equilateral_rectangle(length, width, columns, rows);
  Jitter jitter(kJitter * spacing);
  std::vector<Vector2d> points;
  for (int r = 0; r <= rows; ++r)
    for (int c = 0; c <= columns; ++c) {
      Vector2d& point = points.emplace_back(c * length / columns, r * width / rows);
      if (cut != Cut::kIrregular) continue;
      if (c > 0 && c < columns) point.x() += jitter();
      if (r > 0 && r < rows) point.y() += jitter();
    }
  std::vector<Triangle> triangles;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const int a = r * (columns + 1) + c, b = a + 1, d = a + columns + 1, e = d + 1;
      const std::array rising = {Triangle{a, b, e}, Triangle{a, e, d}};
      const std::array falling = {Triangle{a, b, d}, Triangle{b, e, d}};
      const auto least = [&](const std::array<Triangle, 2>& pair) {
        return std::min(least_sine(points, pair[0]), least_sine(points, pair[1]));
      };
      bool rises = cut == Cut::kRight || (r + c) % 2 == 0;
      if (cut == Cut::kIrregular) rises = least(rising) > least(falling);
      const auto& pair = rises ? rising : falling;
      triangles.insert(triangles.end(), pair.begin(), pair.end());
    }
  return rest_shape(points, triangles);
}

RestShape cut_disc(Cut cut, double radius, double spacing) {
  const double step = column_step(cut) * spacing;
  const int half = static_cast<int>(std::ceil(radius / step));
  Jitter jitter(kJitter * spacing);
  std::vector<Vector2d> points;
  std::vector<double> lift;
  const auto add = [&](const Vector2d& point, double lower) {
    points.push_back(point);
    lift.push_back(point.squaredNorm() - lower);
  };
  for (int r = -half; r <= half; ++r)
    for (int c = -half; c <= half; ++c) {
      Vector2d point(c * step, r * spacing);
      if (cut == Cut::kEquilateral && c % 2 != 0) point.y() += spacing / 2;
      if (cut == Cut::kIrregular) point += Vector2d(jitter(), jitter());
      // which diagonal of a square is an edge; points on one circle leave it open
      constexpr double kSlight = 1e-3;
      const double lower = cut == Cut::kRight ? kSlight * point.x() * point.y()
                           : (r + c) % 2 == 0 ? kSlight * spacing * spacing
                                              : 0;
      constexpr double kFree = 0.6;  // spacings between those inside and the border
      if (point.norm() < radius - kFree * spacing) add(point, lower);
    }
  const int around =
      std::max(6, static_cast<int>(std::lround(2 * std::numbers::pi * radius / spacing)));
  for (int k = 0; k < around; ++k) {
    const double angle = 2 * std::numbers::pi * (k + 0.5) / around;
    add(radius * Vector2d(std::cos(angle), std::sin(angle)), 0);
  }
  return rest_shape(points, lower_hull(points, lift));
}

RestShape rest_shape(const std::vector<Vector2d>& points, const std::vector<Triangle>& triangles) {
  RestShape shape;
  shape.particles = static_cast<int>(points.size());
  shape.triangles = triangles;
  for (const Triangle& triangle : triangles) {
    auto& corners = shape.corners.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) corners[k] = at(points, triangle[k]);
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

}  // namespace weft

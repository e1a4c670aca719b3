#include "core/triangles/rest_shape.h"

#include <algorithm>
#include <cmath>

namespace weft {
namespace {

// Every edge of every triangle, the smaller index first, sorted.
std::vector<Connection> sides(const RestShape& shape) {
  std::vector<Connection> all;
  all.reserve(3 * shape.triangles.size());
  for (const auto& triangle : shape.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      all.emplace_back(std::minmax(triangle[k], triangle[(k + 1) % 3]));
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

RestShape rest_shape(const TriangleMesh& mesh) {
  RestShape shape{static_cast<int>(mesh.start.size()), mesh.triangles, {}, {}};
  shape.corners.reserve(mesh.triangles.size());
  shape.panel.reserve(mesh.triangles.size());
  for (std::size_t p = 0, t = 0; p < mesh.panels.size(); ++p) {
    // turned so that the warp lies along u
    const double sine = std::sin(mesh.panels[p].grain), cosine = std::cos(mesh.panels[p].grain);
    for (int n = 0; n < mesh.panels[p].triangles; ++n, ++t) {
      auto& corners = shape.corners.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector2d& flat = flat_corner(mesh, t, k);
        corners[k] = {cosine * flat.y() - sine * flat.x(), -cosine * flat.x() - sine * flat.y()};
      }
      shape.panel.push_back(static_cast<int>(p));
    }
  }
  return shape;
}

double area(const std::array<Vector2d, 3>& corners) {
  const Vector2d a = corners[1] - corners[0], b = corners[2] - corners[0];
  return (a.x() * b.y() - b.x() * a.y()) / 2;
}

VectorXd areas(const RestShape& shape) {
  VectorXd sum = VectorXd::Zero(shape.particles);
  for (std::size_t t = 0; t < shape.triangles.size(); ++t)
    for (const int i : shape.triangles[t]) sum[i] += area(shape.corners[t]) / 3;
  return sum;
}

std::vector<Connection> edges(const RestShape& shape) {
  std::vector<Connection> all = sides(shape);
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

std::vector<bool> border(const RestShape& shape) {
  std::vector<bool> lies(static_cast<std::size_t>(shape.particles));
  const std::vector<Connection> all = sides(shape);
  for (std::size_t e = 0; e < all.size(); ++e) {
    if ((e > 0 && all[e - 1] == all[e]) || (e + 1 < all.size() && all[e + 1] == all[e])) continue;
    for (const int i : {all[e].first, all[e].second}) lies[static_cast<std::size_t>(i)] = true;
  }
  return lies;
}

Corners::Corners(const RestShape& shape) : first_(static_cast<std::size_t>(shape.particles) + 1) {
  for (const auto& triangle : shape.triangles)
    for (const int i : triangle) ++first_[static_cast<std::size_t>(i) + 1];
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  all_.resize(first_.back());
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  for (std::size_t t = 0; t < shape.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      all_[next[static_cast<std::size_t>(shape.triangles[t][static_cast<std::size_t>(k)])]++] = {
          static_cast<int>(t), k};
}

std::vector<MembraneElement> make_membrane(const RestShape& shape) {
  std::vector<MembraneElement> elements;
  elements.reserve(shape.triangles.size());
  for (std::size_t t = 0; t < shape.triangles.size(); ++t) {
    const auto& corner = shape.corners[t];
    MembraneElement& element = elements.emplace_back();
    element.particle = shape.triangles[t];
    element.area = area(corner);
    element.panel = panel_of(shape, t);
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector2d opposite = corner[(k + 1) % 3] - corner[(k + 2) % 3];
      element.du[k] = opposite.y() / (2 * element.area);
      element.dv[k] = -opposite.x() / (2 * element.area);
    }
  }
  return elements;
}

}  // namespace weft

#include "core/triangles/rest_shape.h"

#include <algorithm>
#include <map>

namespace weft {
namespace {

// How many triangles each edge has.
std::map<Connection, int> counted_edges(const RestShape& shape) {
  std::map<Connection, int> count;
  for (const auto& triangle : shape.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [i, j] = std::minmax(triangle[k], triangle[(k + 1) % 3]);
      ++count[{i, j}];
    }
  return count;
}

}  // namespace

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
  std::vector<Connection> all;
  for (const auto& [edge, count] : counted_edges(shape)) all.push_back(edge);
  return all;
}

std::vector<bool> border(const RestShape& shape) {
  std::vector<bool> lies(static_cast<std::size_t>(shape.particles));
  for (const auto& [edge, count] : counted_edges(shape))
    if (count == 1)
      for (const int i : {edge.first, edge.second}) lies[static_cast<std::size_t>(i)] = true;
  return lies;
}

}  // namespace weft

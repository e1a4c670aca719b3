#include "client/exports/normals.h"

#include <cmath>

namespace weft::client {

std::vector<std::array<float, 3>> normals_of(const Points& points,
                                             const std::vector<std::uint32_t>& triangles) {
  std::vector<std::array<double, 3>> sums(points.x.size());
  for (std::size_t t = 0; t < triangles.size(); t += 3) {
    const std::uint32_t a = triangles[t];
    const auto edge = [&](std::uint32_t b) {
      return std::array{points.x[b] - points.x[a], points.y[b] - points.y[a],
                        points.z[b] - points.z[a]};
    };
    const auto u = edge(triangles[t + 1]);
    const auto v = edge(triangles[t + 2]);
    for (std::size_t corner = t; corner < t + 3; ++corner) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t next = (axis + 1) % 3;
        const std::size_t last = (axis + 2) % 3;
        sums[triangles[corner]][axis] += u[next] * v[last] - u[last] * v[next];
      }
    }
  }
  std::vector<std::array<float, 3>> normals(sums.size());
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const auto& [x, y, z] = sums[i];
    const double length = std::hypot(x, y, z);
    normals[i] = {0, 1, 0};  // where the triangles have no area
    if (length > 0) {
      normals[i] = {static_cast<float>(x / length), static_cast<float>(y / length),
                    static_cast<float>(z / length)};
    }
  }
  return normals;
}

}  // namespace weft::client

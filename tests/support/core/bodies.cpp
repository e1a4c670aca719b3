#include "tests/support/core/bodies.h"

#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

namespace weft::testing {

BodyMesh ball_mesh(double radius, int cuts) {
  BodyMesh mesh;
  const double golden = (1 + std::sqrt(5.0)) / 2;
  for (const double a : {-1.0, 1.0})
    for (const double b : {-golden, golden})
      for (const Vector3d& v : {Vector3d(0, a, b), Vector3d(a, b, 0), Vector3d(b, 0, a)})
        mesh.vertices.push_back(radius * v.normalized());
  // all that are neighbours of each other, seen from outside
  const double edge = 1.1 * radius / std::sin(0.4 * std::acos(-1));
  const auto at = [&](int i) { return mesh.vertices[static_cast<std::size_t>(i)]; };
  const auto near = [&](int i, int j) { return (at(i) - at(j)).norm() < edge; };
  for (int a = 0; a < 12; ++a)
    for (int b = a + 1; b < 12; ++b)
      for (int c = b + 1; c < 12; ++c) {
        if (!near(a, b) || !near(b, c) || !near(c, a)) continue;
        const bool outward = at(a).dot(at(b).cross(at(c))) > 0;
        mesh.triangles.push_back(outward ? std::array{a, b, c} : std::array{a, c, b});
      }
  for (int cut = 0; cut < cuts; ++cut) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int i, int j) {
      const auto [found, is_new] =
          middles.try_emplace(std::minmax(i, j), static_cast<int>(mesh.vertices.size()));
      if (is_new) mesh.vertices.push_back(radius * (at(i) + at(j)).normalized());
      return found->second;
    };
    std::vector<std::array<int, 3>> quarters;
    for (const auto& [a, b, c] : mesh.triangles) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      for (const auto& each : {std::array{a, ab, ca}, std::array{b, bc, ab}, std::array{c, ca, bc},
                               std::array{ab, bc, ca}})
        quarters.push_back(each);
    }
    mesh.triangles = std::move(quarters);
  }
  return mesh;
}

BodyMesh box_mesh(const Vector3d& half_size, const Quaterniond& turn) {
  BodyMesh mesh;
  for (const double z : {-1.0, 1.0})
    for (const double y : {-1.0, 1.0})
      for (const double x : {-1.0, 1.0})
        mesh.vertices.emplace_back(turn * half_size.cwiseProduct(Vector3d(x, y, z)));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

BodyMesh together(BodyMesh one, const BodyMesh& other, const Vector3d& moved) {
  const int first = static_cast<int>(one.vertices.size());
  for (const Vector3d& v : other.vertices) one.vertices.push_back(v + moved);
  for (const auto& [a, b, c] : other.triangles)
    one.triangles.push_back({a + first, b + first, c + first});
  return one;
}

Collider solid(const BodyMesh& mesh, double friction) {
  MadeBody made = make_body(mesh, {.reach = 0.01}, "mesh");
  if (!made.body) throw std::runtime_error(made.problems[0].message);
  return {"body", std::move(made.body), friction, {}};
}

}  // namespace weft::testing

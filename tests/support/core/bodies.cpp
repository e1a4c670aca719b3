#include "tests/support/core/bodies.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace weft::testing {
namespace {

// By golden section along two edges: the squared distance is convex in the place on a triangle.
double distance_from_triangle(const Vector3d& a, const Vector3d& b, const Vector3d& c,
                              const Vector3d& point) {
  const auto least = [](const auto& f) {
    constexpr double kRatio = std::numbers::phi - 1;
    double low = 0, high = 1, best = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 40; ++i) {
      const double one = high - kRatio * (high - low), other = low + kRatio * (high - low);
      const double at_one = f(one), at_other = f(other);
      best = std::min({best, at_one, at_other});
      (at_one < at_other ? high : low) = at_one < at_other ? other : one;
    }
    return std::min({best, f(0.0), f(1.0)});
  };
  return std::sqrt(least([&](double u) {
    return least([&](double v) {
      return (a + u * (1 - v) * (b - a) + u * v * (c - a) - point).squaredNorm();
    });
  }));
}

// Solid angles (van Oosterom and Strackee 1983) over 4 pi: 1 inside, 0 outside.
double winding(const BodyMesh& mesh, const Vector3d& point) {
  double sum = 0;
  for (const auto& triangle : mesh.triangles) {
    const Vector3d a = corner_of(mesh, triangle, 0) - point,
                   b = corner_of(mesh, triangle, 1) - point,
                   c = corner_of(mesh, triangle, 2) - point;
    const double p = a.norm(), q = b.norm(), r = c.norm();
    sum +=
        2 * std::atan2(a.dot(b.cross(c)), p * q * r + a.dot(b) * r + b.dot(c) * p + c.dot(a) * q);
  }
  return sum / (4 * std::numbers::pi);
}

}  // namespace

Vector3d corner_of(const BodyMesh& mesh, const std::array<int, 3>& triangle, std::size_t k) {
  return mesh.vertices[static_cast<std::size_t>(triangle[k])];
}

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

double signed_distance(const BodyMesh& mesh, const Vector3d& point) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& triangle : mesh.triangles) {
    const Vector3d a = corner_of(mesh, triangle, 0), b = corner_of(mesh, triangle, 1),
                   c = corner_of(mesh, triangle, 2);
    if ((a - point).norm() - std::max((b - a).norm(), (c - a).norm()) > least) continue;
    least = std::min(least, distance_from_triangle(a, b, c, point));
  }
  return winding(mesh, point) > 0.5 ? -least : least;
}

Collider posed(const BodyMesh& mesh, const std::vector<double>& times, const Way& way, double cell,
               double friction) {
  Poses poses{times, {}, {}, {}, {}};
  BodyMesh first = mesh;
  for (Vector3d& vertex : first.vertices) vertex = way(vertex, times[0]);
  for (const double time : times)
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      for (const Vector3d& vertex : mesh.vertices)
        poses.positions.push_back(static_cast<float>(way(vertex, time)[axis]));
  MadeBody made = make_body(std::move(first), {.cell = cell, .reach = 1e-3}, "mesh");
  if (auto problems = find_problems(poses, mesh.vertices.size(), "poses"); !problems.empty())
    made.problems = std::move(problems);
  if (!made.problems.empty()) throw std::runtime_error(made.problems[0].message);
  return {"body", std::move(made.body), friction, {}, complete(std::move(poses))};
}

BodyMesh mesh_at(const Collider& body, double time) {
  const Poses& poses = *body.poses;
  BodyMesh mesh = std::get<SharedBody>(body.shape)->mesh;
  const auto next = std::upper_bound(poses.times.begin(), poses.times.end() - 1, time);
  const auto to = static_cast<std::size_t>(std::max(next - poses.times.begin(), std::ptrdiff_t{1}));
  const double share =
      std::clamp((time - poses.times[to - 1]) / (poses.times[to] - poses.times[to - 1]), 0.0, 1.0);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    mesh.vertices[v] = (1 - share) * poses.position(to - 1, v) + share * poses.position(to, v);
  return mesh;
}

}  // namespace weft::testing

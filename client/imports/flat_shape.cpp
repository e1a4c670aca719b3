#include "client/imports/flat_shape.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "client/imports/edges.h"

namespace weft::client {
namespace {

const Vector3d& position(const ImportedMesh& mesh, int particle) {
  return mesh.positions[as_index(particle)];
}

// Twice the area, along the normal.
Vector3d area_vector(const ImportedMesh& mesh, const std::array<int, 3>& triangle) {
  const Vector3d& first = position(mesh, triangle[0]);
  return (position(mesh, triangle[1]) - first).cross(position(mesh, triangle[2]) - first);
}

double quantile(std::vector<double>& values, double part) {
  if (values.empty()) return 0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// A place of a particle in the flat shape.
struct Place {
  Vector2d at;
  int number;
};

int place_at(std::vector<Place>& places, const Vector2d& at, double tolerance, int& next) {
  for (const Place& place : places)
    if ((place.at - at).lpNorm<Eigen::Infinity>() <= tolerance) return place.number;
  places.push_back({at, next});
  return next++;
}

// u and v of a plane in space.
struct PlaneAxes {
  Vector3d u, v;
};

PlaneAxes axes_of(const Vector3d& normal) {
  constexpr double kLevel = 0.99;
  const Vector3d up =
      std::abs(normal.y()) > kLevel ? Vector3d(-Vector3d::UnitZ()) : Vector3d(Vector3d::UnitY());
  const Vector3d u = up.cross(normal).normalized();
  return {u, normal.cross(u)};
}

}  // namespace

FlatCorners flat_corners(const ImportedMesh& mesh, std::size_t triangle) {
  const auto at = [&](std::size_t k) {
    return mesh.flat[static_cast<std::size_t>(mesh.corners[triangle][k])];
  };
  return {at(0), at(1), at(2)};
}

double signed_area(const FlatCorners& corners) {
  const Vector2d a = corners[1] - corners[0], b = corners[2] - corners[0];
  return (a.x() * b.y() - a.y() * b.x()) / 2;
}

double least_height(const FlatCorners& corners) {
  double longest = 0;
  for (std::size_t k = 0; k < 3; ++k)
    longest = std::max(longest, (corners[(k + 1) % 3] - corners[k]).norm());
  return longest > 0 ? 2 * std::abs(signed_area(corners)) / longest : 0;
}

double least_height(const ImportedMesh& mesh, std::size_t triangle) {
  return least_height(flat_corners(mesh, triangle));
}

void join_corners(ImportedMesh& mesh, double tolerance) {
  std::vector<std::vector<Place>> places(mesh.positions.size());
  std::vector<Vector2d> flat(mesh.positions.size(), Vector2d::Zero());
  auto next = static_cast<int>(flat.size());  // the first place of a particle has its number
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      int& corner = mesh.corners[t][k];
      if (corner == kNoCorner) continue;
      const auto particle = static_cast<std::size_t>(mesh.triangles[t][k]);
      const Vector2d at = mesh.flat[as_index(corner)];
      if (places[particle].empty()) {
        places[particle].push_back({at, static_cast<int>(particle)});
        flat[particle] = at;
      }
      corner = place_at(places[particle], at, tolerance, next);
      if (next > static_cast<int>(flat.size())) flat.push_back(at);
    }
  }
  mesh.flat = std::move(flat);
}

int find_islands(const ImportedMesh& mesh, std::vector<int>& island) {
  Unions unions(mesh.triangles.size());
  for_each_edge(sides_of(mesh.corners), [&](std::span<const Side> sides) {
    for (const Side& side : sides)
      if (side.low != kNoCorner) unions.join(sides[0].triangle, side.triangle);
  });
  return unions.number(island);
}

int turn_mirrored_islands(ImportedMesh& mesh, double grain_rad) {
  std::vector<int> island;
  const int count = find_islands(mesh, island);
  std::vector<double> area(as_index(count), 0.0);
  for (std::size_t t = 0; t < island.size(); ++t)
    area[as_index(island[t])] += signed_area(flat_corners(mesh, t));

  const Vector2d warp(-std::sin(grain_rad), std::cos(grain_rad));
  std::vector<Vector2d> flat;  // a place of its own for each corner
  for (std::size_t t = 0; t < island.size(); ++t) {
    const bool mirrored = area[as_index(island[t])] < 0;
    const FlatCorners corners = flat_corners(mesh, t);
    for (std::size_t k = 0; k < 3; ++k) {
      mesh.corners[t][k] = static_cast<int>(flat.size());
      flat.push_back(mirrored ? 2 * warp * warp.dot(corners[k]) - corners[k] : corners[k]);
    }
  }
  mesh.flat = std::move(flat);
  join_corners(mesh, 0);
  return static_cast<int>(std::count_if(area.begin(), area.end(), [](double a) { return a < 0; }));
}

bool flatten(ImportedMesh& mesh) {
  constexpr double kFlat = 1e-4;  // of the size
  Vector3d normal = Vector3d::Zero();
  for (const auto& triangle : mesh.triangles) normal += area_vector(mesh, triangle);
  if (normal.norm() == 0) return false;
  normal.normalize();
  const Vector3d origin = mesh.positions[0];
  const double most = kFlat * size_of(mesh.positions);
  for (const Vector3d& each : mesh.positions)
    if (std::abs((each - origin).dot(normal)) > most) return false;

  const auto [u, v] = axes_of(normal);
  mesh.flat.clear();
  for (const Vector3d& each : mesh.positions)
    mesh.flat.emplace_back((each - origin).dot(u), (each - origin).dot(v));
  mesh.corners = mesh.triangles;
  return true;
}

bool flatten_pieces(ImportedMesh& mesh) {
  constexpr double kFlat = 1e-4, kApart = 0.05;  // of the size
  Unions unions(mesh.positions.size());
  for (const auto& [a, b, c] : mesh.triangles) unions.join(a, b), unions.join(b, c);
  std::vector<int> piece;
  const int count = unions.number(piece);
  std::vector<Vector3d> normal(as_index(count), Vector3d::Zero());
  std::vector<int> first(as_index(count), -1);
  for (const auto& triangle : mesh.triangles) {
    const auto p = as_index(piece[as_index(triangle[0])]);
    normal[p] += area_vector(mesh, triangle);
    if (first[p] < 0) first[p] = triangle[0];
  }
  const double size = size_of(mesh.positions);
  std::vector<double> least(as_index(count), 0), most(as_index(count), 0);
  std::vector<Vector2d> flat(mesh.positions.size(), Vector2d::Zero());
  for (std::size_t i = 0; i < flat.size(); ++i) {
    const auto p = as_index(piece[i]);
    if (first[p] < 0) continue;  // a point of no triangle
    if (normal[p].norm() == 0) return false;
    const Vector3d upright = normal[p].normalized(),
                   offset = mesh.positions[i] - mesh.positions[as_index(first[p])];
    if (std::abs(offset.dot(upright)) > kFlat * size) return false;
    const auto [u, v] = axes_of(upright);
    flat[i] = {offset.dot(u), offset.dot(v)};
    least[p] = std::min(least[p], flat[i].x());
    most[p] = std::max(most[p], flat[i].x());
  }
  double right = 0;
  for (std::size_t p = 0; p < as_index(count); ++p) {
    const double width = most[p] - least[p];
    most[p] = right - least[p];  // by what it is moved
    right += width + kApart * size;
  }
  for (std::size_t i = 0; i < flat.size(); ++i) flat[i].x() += most[as_index(piece[i])];
  mesh.flat = std::move(flat);
  mesh.corners = mesh.triangles;
  return true;
}

ScaleFound find_scale(const ImportedMesh& mesh) {
  std::vector<double> all;
  std::vector<std::vector<double>> of_panel(mesh.panels.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const FlatCorners corners = flat_corners(mesh, t);
    for (std::size_t k = 0; k < 3; ++k) {
      const double flat = (corners[(k + 1) % 3] - corners[k]).norm();
      const double length =
          (position(mesh, mesh.triangles[t][(k + 1) % 3]) - position(mesh, mesh.triangles[t][k]))
              .norm();
      if (flat == 0 || length == 0 || !std::isfinite(length / flat)) continue;
      all.push_back(length / flat);
      of_panel[static_cast<std::size_t>(mesh.panel[t])].push_back(length / flat);
    }
  }
  ScaleFound found{quantile(all, 0.5), quantile(all, 0.05), quantile(all, 0.95), {}};
  for (auto& ratios : of_panel) found.median_of_panel.push_back(quantile(ratios, 0.5));
  return found;
}

double rounded_scale(double found) {
  constexpr double kNear = 0.01;
  for (const double unit : {1.0, 0.1, 0.01, 0.001})
    if (std::abs(found / unit - 1) <= kNear) return unit;
  return found;
}

}  // namespace weft::client

#include "client/imports/polygon.h"

#include <Eigen/Geometry>
#include <numeric>

namespace weft::client {
namespace {

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// Corners in their mean plane, anticlockwise; its normal is Newell's.
std::vector<Vector2d> in_plane(const std::vector<Vector3d>& corners) {
  Vector3d normal = Vector3d::Zero();
  for (std::size_t i = 0; i < corners.size(); ++i)
    normal += (corners[i] - corners[0]).cross(corners[(i + 1) % corners.size()] - corners[0]);
  const Vector3d across = normal.unitOrthogonal();
  const Vector3d along = normal.cross(across).normalized();
  std::vector<Vector2d> result;
  for (const Vector3d& corner : corners)
    result.emplace_back((corner - corners[0]).dot(across), (corner - corners[0]).dot(along));
  return result;
}

bool inside(const Vector2d& p, const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return cross(b - a, p - a) >= 0 && cross(c - b, p - b) >= 0 && cross(a - c, p - c) >= 0;
}

// Whether the corner at k of those left can be cut off.
bool is_ear(const std::vector<Vector2d>& points, const std::vector<int>& left, std::size_t k) {
  const auto point = [&](std::size_t i) {
    return points[static_cast<std::size_t>(left[i % left.size()])];
  };
  const Vector2d a = point(k + left.size() - 1), b = point(k), c = point(k + 1);
  if (cross(b - a, c - b) <= 0) return false;
  for (std::size_t i = k + 2; i < k + left.size() - 1; ++i)
    if (inside(point(i), a, b, c)) return false;
  return true;
}

// Of four corners, which one to cut off first.
std::size_t first_of_quad(const std::vector<Vector2d>& points, const std::vector<int>& all) {
  const bool shorter = (points[1] - points[3]).norm() < (points[0] - points[2]).norm();
  const std::size_t wanted = shorter ? 0 : 1;
  return is_ear(points, all, wanted) && is_ear(points, all, wanted + 2) ? wanted : 1 - wanted;
}

}  // namespace

Triangles cut_polygon(const std::vector<Vector3d>& corners) {
  std::vector<int> left(corners.size());
  std::iota(left.begin(), left.end(), 0);
  Triangles triangles;
  if (left.size() == 3) return {{0, 1, 2}};
  const std::vector<Vector2d> points = in_plane(corners);
  std::size_t next = left.size() == 4 ? first_of_quad(points, left) : 0;
  while (left.size() > 3) {
    std::size_t ear = next % left.size();
    for (std::size_t tried = 0; tried < left.size() && !is_ear(points, left, ear); ++tried)
      ear = (ear + 1) % left.size();
    const std::size_t n = left.size();
    triangles.push_back({left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
    next = ear + 1;  // not a fan around one corner
  }
  triangles.push_back({left[0], left[1], left[2]});
  return triangles;
}

}  // namespace weft::client

#include "core/pattern/overlaps.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/pattern/folded_panel.h"
#include "core/pattern/sets.h"

namespace weft {
namespace {

constexpr double kOnePlane = 1e-3;  // planes that are closer are one, m
constexpr double kParallel = 1e-3;  // their normals, rad
constexpr double kGap = 2e-3;       // left between panels that were moved apart, m
constexpr int kMostRounds = 8;      // for panels that meet others where they are moved to

// A panel as it is placed, in the plane of another.
struct Placed {
  std::vector<Vector2d> points;
  std::vector<std::array<int, 3>> triangles;
  Vector2d middle = Vector2d::Zero();
  Eigen::AlignedBox2d box = {};
};

bool is_within(const std::array<Vector2d, 3>& corners, const Vector2d& point) {
  const auto side = [&](std::size_t k) {
    const Vector2d along = corners[(k + 1) % 3] - corners[k], to = point - corners[k];
    return along.x() * to.y() - along.y() * to.x() > 0;
  };
  const bool first = side(0);
  return side(1) == first && side(2) == first;
}

std::array<Vector2d, 3> corners_of(const Placed& panel, const std::array<int, 3>& triangle) {
  return {panel.points[as_index(triangle[0])], panel.points[as_index(triangle[1])],
          panel.points[as_index(triangle[2])]};
}

// Whether the middle of a triangle of one lies within the other: borders that touch do not.
bool covers(const Placed& one, const Placed& other) {
  if (one.box.intersection(other.box).isEmpty()) return false;
  return std::ranges::any_of(other.triangles, [&](const auto& triangle) {
    const auto [a, b, c] = corners_of(other, triangle);
    const Vector2d middle = (a + b + c) / 3;
    return std::ranges::any_of(
        one.triangles, [&](const auto& each) { return is_within(corners_of(one, each), middle); });
  });
}

// How far a panel reaches along a direction on a line across it.
struct Reach {
  double least = std::numeric_limits<double>::infinity(), most = -least;
};

Reach reach_on(const Placed& panel, const Vector2d& along, double across) {
  Reach reach;
  const Vector2d left{-along.y(), along.x()};
  for (const auto& triangle : panel.triangles) {
    const auto corners = corners_of(panel, triangle);
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector2d &a = corners[k], &b = corners[(k + 1) % 3];
      const double from = a.dot(left), to = b.dot(left);
      if (across < std::min(from, to) || across > std::max(from, to)) continue;
      const double share = from == to ? 0 : (across - from) / (to - from);
      for (const Vector2d& at :
           {Vector2d(a + share * (b - a)), from == to ? b : a + share * (b - a)}) {
        reach.least = std::min(reach.least, at.dot(along));
        reach.most = std::max(reach.most, at.dot(along));
      }
    }
  }
  return reach;
}

// The way along a direction after which `second` lies beyond `first`.
double way_apart(const Placed& first, const Placed& second, const Vector2d& along) {
  const Vector2d left{-along.y(), along.x()};
  double way = 0;
  for (const Placed* panel : {&first, &second})
    for (const Vector2d& point : panel->points) {
      const double across = point.dot(left);
      way = std::max(way,
                     reach_on(first, along, across).most - reach_on(second, along, across).least);
    }
  return way;
}

}  // namespace

std::vector<Overlap> draw_apart(const Pattern& pattern, const std::vector<PanelMesh>& meshes,
                                std::vector<Vector3d>& origins) {
  std::vector<Eigen::Matrix3d> turns;
  for (const PatternPanel& panel : pattern.panels)
    turns.push_back(panel.rotation.normalized().toRotationMatrix());

  // in the plane of panel `in`, from its origin; none where the panel lies in no plane, or another
  const auto placed = [&](std::size_t p, std::size_t in) -> std::optional<Placed> {
    if (starts_folded(pattern.panels[p])) return std::nullopt;
    const Eigen::Matrix3d turn = turns[in].transpose() * turns[p];
    const Vector3d origin = turns[in].transpose() * (origins[p] - origins[in]);
    if (turn.col(2).head<2>().norm() > kParallel) return std::nullopt;
    Placed found{.points = {}, .triangles = meshes[p].triangles};
    for (const Vector2d& point : meshes[p].points) {
      const Vector3d at = origin + turn.leftCols<2>() * point;
      if (std::abs(at.z()) > kOnePlane) return std::nullopt;
      found.points.emplace_back(at.head<2>());
      found.middle += found.points.back() / static_cast<double>(meshes[p].points.size());
      found.box.extend(found.points.back());
    }
    return found;
  };

  std::vector<Overlap> all;
  for (int round = 0; round < kMostRounds; ++round) {
    std::vector<Vector3d> moves(origins.size(), Vector3d::Zero());
    bool moved = false;
    for (std::size_t p = 0; p < meshes.size(); ++p)
      for (std::size_t q = p + 1; q < meshes.size(); ++q) {
        const auto second = placed(q, p);
        if (!second) continue;
        const auto first = placed(p, p);
        if (!first || (!covers(*first, *second) && !covers(*second, *first))) continue;
        const Vector2d between = second->middle - first->middle;
        if (between.norm() < kGap) continue;
        const double way = way_apart(*first, *second, between.normalized()) + kGap;
        const Vector3d half = way / 2 * (turns[p].leftCols<2>() * between.normalized());
        moves[p] -= half;
        moves[q] += half;
        moved = true;
        if (round == 0) all.push_back({p, q, way});
      }
    if (!moved) break;
    for (std::size_t p = 0; p < origins.size(); ++p) origins[p] += moves[p];
  }
  return all;
}

}  // namespace weft

#include "client/imports/borders.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <charconv>
#include <map>
#include <set>

#include "client/imports/edges.h"

namespace weft::client {
namespace {

// An edge of one triangle, as it runs there.
struct BorderEdge {
  int from, to, opposite;
};

std::vector<BorderEdge> border_edges(const Triangles& triangles) {
  std::vector<BorderEdge> edges;
  for_each_edge(sides_of(triangles), [&](std::span<const Side> sides) {
    if (sides.size() != 1) return;
    const auto& triangle = triangles[as_index(sides[0].triangle)];
    const auto k = as_index(sides[0].k);
    edges.push_back({triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]});
  });
  return edges;
}

const Vector3d& at(const std::vector<Vector3d>& positions, int particle) {
  return positions[as_index(particle)];
}

double length(const std::vector<Vector3d>& positions, const BorderEdge& edge) {
  return (at(positions, edge.to) - at(positions, edge.from)).norm();
}

// As seen: the box around, of all that have a triangle.
Eigen::AlignedBox2d seen_box(const std::vector<Vector3d>& positions, const Triangles& triangles,
                             const View& view) {
  Eigen::AlignedBox2d box;
  for (const auto& triangle : triangles)
    for (const int i : triangle)
      box.extend(Vector2d(at(positions, i).dot(view.right), at(positions, i).dot(view.up)));
  return box;
}

// Where a loop lies as a whole: well off the middle.
std::string name_of(const Vector3d& centre, const Eigen::AlignedBox2d& box, const View& view) {
  constexpr double kOff = 0.35;  // of the way from the middle to the end
  const Vector2d seen(centre.dot(view.right), centre.dot(view.up));
  const Vector2d half = (box.sizes() / 2).cwiseMax(1e-12);
  const Vector2d off = (seen - box.center()).cwiseQuotient(half);
  if (off.cwiseAbs().maxCoeff() < kOff) return "";
  if (std::abs(off.y()) >= std::abs(off.x())) return off.y() > 0 ? "top" : "bottom";
  return off.x() < 0 ? "left" : "right";
}

// Which way an edge looks, away from its triangle.
std::string side_of(const std::vector<Vector3d>& positions, const BorderEdge& edge,
                    const View& view) {
  const Vector3d along = (at(positions, edge.to) - at(positions, edge.from)).normalized();
  const Vector3d inwards = at(positions, edge.opposite) - at(positions, edge.from);
  const Vector3d outwards = along * along.dot(inwards) - inwards;
  const double up = outwards.dot(view.up), right = outwards.dot(view.right);
  if (std::abs(up) >= std::abs(right)) return up > 0 ? "top" : "bottom";
  return right < 0 ? "left" : "right";
}

Border follow(const std::vector<Vector3d>& positions, const std::vector<BorderEdge>& edges,
              std::multimap<int, std::size_t>& from, std::size_t first) {
  Border border;
  for (std::size_t edge = first;;) {
    border.particles.push_back(edges[edge].from);
    border.length += length(positions, edges[edge]);
    const auto next = from.find(edges[edge].to);
    if (next == from.end()) break;
    edge = next->second;
    from.erase(next);
    if (edge == first) break;
  }
  for (const int i : border.particles)
    border.centre += at(positions, i) / static_cast<double>(border.particles.size());
  return border;
}

}  // namespace

View view_of(const std::vector<Vector3d>& positions) {
  constexpr double kLevel = 0.1;  // height over depth
  Eigen::AlignedBox3d box;
  for (const Vector3d& each : positions) box.extend(each);
  View view;
  if (!box.isEmpty() && box.sizes().y() < kLevel * box.sizes().z()) view.up = -Vector3d::UnitZ();
  return view;
}

std::vector<Border> find_borders(const std::vector<Vector3d>& positions, const Triangles& triangles,
                                 const View& view) {
  const std::vector<BorderEdge> edges = border_edges(triangles);
  std::multimap<int, std::size_t> from;
  for (std::size_t i = 0; i < edges.size(); ++i) from.emplace(edges[i].from, i);
  const Eigen::AlignedBox2d box = seen_box(positions, triangles, view);
  std::vector<Border> borders;
  while (!from.empty()) {
    const std::size_t first = from.begin()->second;
    // it is taken last, where its loop closes
    Border border = follow(positions, edges, from, first);
    const auto [begin, end] = from.equal_range(edges[first].from);
    for (auto each = begin; each != end; ++each) {
      if (each->second != first) continue;
      from.erase(each);
      break;
    }
    border.name = name_of(border.centre, box, view);
    borders.push_back(std::move(border));
  }
  std::stable_sort(borders.begin(), borders.end(),
                   [](const Border& a, const Border& b) { return a.length > b.length; });
  return borders;
}

BorderSide border_called(const std::vector<Vector3d>& positions, const Triangles& triangles,
                         const View& view, const std::string& name) {
  BorderSide result;
  std::set<int> particles;
  const std::vector<Border> borders = find_borders(positions, triangles, view);
  for (std::size_t i = 0; i < borders.size(); ++i) {
    if (borders[i].name != name && std::to_string(i + 1) != name) continue;
    particles.insert(borders[i].particles.begin(), borders[i].particles.end());
    result.length += borders[i].length;
  }
  if (particles.empty()) {
    for (const BorderEdge& edge : border_edges(triangles)) {
      if (side_of(positions, edge, view) != name) continue;
      particles.insert({edge.from, edge.to});
      result.length += length(positions, edge);
    }
  }
  result.particles.assign(particles.begin(), particles.end());
  return result;
}

}  // namespace weft::client

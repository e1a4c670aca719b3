#include "core/pattern/held.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "core/pattern/sets.h"

namespace weft {
namespace {

// Particles of each closed border, in order.
std::vector<std::vector<int>> borders_of(const TriangleMesh& mesh) {
  std::set<std::pair<int, int>> sides;
  for (const auto& [a, b, c] : mesh.triangles)
    for (const auto& side : {std::pair(a, b), {b, c}, {c, a}}) sides.insert(side);
  std::map<int, int> next;
  for (const auto& [from, to] : sides)
    if (!sides.contains({to, from})) next[from] = to;
  std::vector<std::vector<int>> borders;
  while (!next.empty()) {
    std::vector<int>& border = borders.emplace_back();
    for (auto at = next.begin(); at != next.end(); at = next.find(border.back())) {
      border.push_back(at->second);
      next.erase(at);
    }
  }
  return borders;
}

// Empty where cloth like shoulders lies above it.
std::vector<int> highest_border(const TriangleMesh& mesh) {
  constexpr double kHardlyAny = 0.05;  // of the area
  const auto height = [&](int i) { return mesh.start[as_index(i)].y(); };
  std::vector<int> highest;
  double top = -std::numeric_limits<double>::infinity();
  for (const std::vector<int>& border : borders_of(mesh)) {
    double mean = 0;
    for (const int i : border) mean += height(i) / static_cast<double>(border.size());
    if (mean > top) top = mean, highest = border;
  }
  if (highest.empty()) return {};
  const double low = height(*std::ranges::min_element(highest, {}, height));
  double above = 0, all = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3d &p = mesh.start[as_index(a)], &q = mesh.start[as_index(b)],
                   &r = mesh.start[as_index(c)];
    const double area = (q - p).cross(r - p).norm();
    all += area;
    if ((p + q + r).y() / 3 > low) above += area;
  }
  return above < kHardlyAny * all ? highest : std::vector<int>{};
}

}  // namespace

std::vector<int> held_particles(const Pattern& pattern, const Garment& garment) {
  const std::vector<int> border = highest_border(garment.mesh);
  if (border.empty()) return {};
  std::set<int> held;
  for (const GarmentEdge& edge : garment.edges) {
    const std::string& label =
        pattern.panels[as_index(edge.panel)].edges[as_index(edge.edge)].label;
    if (label == "waist" || label.starts_with("waist-"))
      held.insert(edge.particles.begin(), edge.particles.end());
  }
  if (held.empty()) held.insert(border.begin(), border.end());
  return {held.begin(), held.end()};
}

}  // namespace weft

#include "core/pattern/held.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <set>

#include "core/pattern/sets.h"
#include "core/triangles/triangles.h"

namespace weft {
namespace {

struct Heights {
  double low, top, mean;  // m
};

Heights heights_of(const TriangleMesh& mesh, const std::vector<int>& border) {
  Heights found{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
                0};
  for (const int i : border) {
    const double height = mesh.start[as_index(i)].y();
    found.low = std::min(found.low, height);
    found.top = std::max(found.top, height);
    found.mean += height / static_cast<double>(border.size());
  }
  return found;
}

double share_above(const TriangleMesh& mesh, double height) {
  double above = 0, all = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3d &p = mesh.start[as_index(a)], &q = mesh.start[as_index(b)],
                   &r = mesh.start[as_index(c)];
    const double area = (q - p).cross(r - p).norm();
    all += area;
    if ((p + q + r).y() / 3 > height) above += area;
  }
  return all > 0 ? above / all : 0;
}

// Empty where shoulders are: cloth above it, or another border beside it, as of an armhole.
std::vector<int> highest_border(const TriangleMesh& mesh) {
  constexpr double kHardlyAny = 0.05;  // of the area
  const std::vector<std::vector<int>> borders = borders_of(mesh);
  std::vector<Heights> heights;
  for (const std::vector<int>& border : borders) heights.push_back(heights_of(mesh, border));
  const auto highest = std::ranges::max_element(heights, {}, &Heights::mean);
  if (highest == heights.end() || share_above(mesh, highest->low) >= kHardlyAny) return {};
  const double middle = (highest->low + highest->top) / 2;
  if (std::ranges::count_if(heights, [&](const Heights& at) { return at.top > middle; }) > 1)
    return {};
  return borders[static_cast<std::size_t>(highest - heights.begin())];
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

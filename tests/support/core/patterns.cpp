#include "tests/support/core/patterns.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/model/mesh_problems.h"

namespace weft::testing {

namespace {

// Middles of triangles in order of v, then u, to a nanometre.
std::vector<std::pair<long, long>> middles(const PanelMesh& mesh, double mirror) {
  std::vector<std::pair<long, long>> all;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto at = [&](int i) { return mesh.points[static_cast<std::size_t>(i)]; };
    const Vector2d middle = (at(a) + at(b) + at(c)) / 3;
    all.emplace_back(std::lround(middle.y() * 1e9), std::lround(mirror * middle.x() * 1e9));
  }
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

PatternEdge line_to(double u, double v) { return {.points = {{u, v}}}; }
PatternEdge arc_to(Vector2d through, Vector2d end) {
  return {.points = {through, end}, .arc = true};
}

PatternPanel panel(std::string name, std::vector<PatternEdge> edges) {
  PatternPanel panel;
  panel.name = std::move(name);
  panel.edges = std::move(edges);
  return panel;
}

PatternPanel rectangle(const std::string& name, double width, double height) {
  return panel(name,
               {line_to(width, 0), line_to(width, height), line_to(0, height), line_to(0, 0)});
}

Garment built(const Pattern& pattern, double edge) {
  auto result = build_garment(pattern, edge, "pattern", "edge_m");
  if (const auto* problems = std::get_if<std::vector<Problem>>(&result)) {
    ADD_FAILURE() << (*problems)[0].field << ": " << (*problems)[0].message;
    return {};
  }
  Garment garment = std::get<Garment>(std::move(result));
  // what is built can be simulated
  const auto problems = find_problems(*complete(garment.mesh), "mesh");
  for (const Problem& each : problems) ADD_FAILURE() << each.field << ": " << each.message;
  return garment;
}

std::vector<Problem> refused(const Pattern& pattern, double edge) {
  auto result = build_garment(pattern, edge, "pattern", "edge_m");
  if (auto* problems = std::get_if<std::vector<Problem>>(&result)) return std::move(*problems);
  ADD_FAILURE() << "was built";
  return {{"", ""}};
}

std::map<std::pair<int, int>, int> edges_of(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> edges;
  for (const auto& triangle : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) ++edges[std::minmax(triangle[k], triangle[(k + 1) % 3])];
  return edges;
}

int euler_number(const TriangleMesh& mesh) {
  return static_cast<int>(mesh.start.size()) - static_cast<int>(edges_of(mesh).size()) +
         static_cast<int>(mesh.triangles.size());
}

void expect_mirrored(const PanelMesh& one, const PanelMesh& other) {
  const auto places = middles(one, 1), images = middles(other, -1);
  ASSERT_EQ(places.size(), images.size());
  for (const auto& [v, u] : places) {
    const auto begin = std::lower_bound(images.begin(), images.end(), std::pair(v - 2, 0L));
    EXPECT_TRUE(std::any_of(begin, images.end(),
                            [&, v = v, u = u](const auto& image) {
                              return std::abs(image.first - v) <= 2 &&
                                     std::abs(image.second - u) <= 2;
                            }))
        << u << ' ' << v << " nm";
  }
}

PatternPanel random_panel(std::mt19937& random) {
  const auto within = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) * 0x1p-32;
  };
  const int corners = 5 + static_cast<int>(random() % 8);
  std::vector<Vector2d> at;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * (i + within(-0.25, 0.25)) / corners;
    at.push_back(within(0.1, 0.25) * Vector2d(std::cos(angle), std::sin(angle)));
  }
  PatternPanel random_one = panel("any", {});
  random_one.grain = within(-3, 3);
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Vector2d end = at[(i + 1) % at.size()], chord = end - at[i];
    PatternEdge edge;
    const auto kind = random() % 3;
    if (kind > 0)
      edge.points.push_back((at[i] + end) / 2 +
                            within(-0.1, 0.1) * Vector2d(chord.y(), -chord.x()));
    edge.points.push_back(end);
    edge.arc = kind == 2;
    random_one.edges.push_back(edge);
  }
  return random_one;
}

}  // namespace weft::testing

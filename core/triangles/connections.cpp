#include "core/triangles/connections.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include "core/triangles/triangles.h"

namespace weft {
namespace {

// An edge with the triangles beside it, as they lie in the frame of the first.
struct Edge {
  int i, j;
  double length;  // flat, mean of both sides, m
  double angle;   // from the warp, rad
  double area;    // a third of the triangles', m^2
  int panel;      // of the first triangle
  int across[2];  // corners opposite to it; -1: none
  double reach;   // between those, m
  double reach_angle;
};

struct EdgeSide {
  int low, high, triangle, corner;  // corner: opposite to the edge
};

std::vector<Edge> edges_with_triangles(const RestShape& shape) {
  std::vector<EdgeSide> sides;
  sides.reserve(3 * shape.triangles.size());
  for (std::size_t t = 0; t < shape.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const auto [i, j] = std::minmax(shape.triangles[t][static_cast<std::size_t>((k + 1) % 3)],
                                      shape.triangles[t][static_cast<std::size_t>((k + 2) % 3)]);
      sides.push_back({i, j, static_cast<int>(t), k});
    }
  std::sort(sides.begin(), sides.end(), [](const EdgeSide& a, const EdgeSide& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });

  // (u, v) of the edge's ends, low and high, and of the corner opposite to it
  const auto points = [&](const EdgeSide& side) {
    const auto t = static_cast<std::size_t>(side.triangle);
    const auto at = [&](int k) { return static_cast<std::size_t>((side.corner + k) % 3); };
    const bool rises = shape.triangles[t][at(1)] == side.low;
    const auto& corners = shape.corners[t];
    return std::array{corners[at(rises ? 1 : 2)], corners[at(rises ? 2 : 1)], corners[at(0)]};
  };
  // along the edge from its middle, and away from it, m
  const auto opposite = [](const std::array<Vector2d, 3>& p) {
    const Vector2d along = (p[1] - p[0]).normalized(), from = p[2] - (p[0] + p[1]) / 2;
    return Vector2d(along.dot(from), along.x() * from.y() - along.y() * from.x());
  };
  std::vector<Edge> edges;
  for (std::size_t s = 0; s < sides.size(); ++s) {
    const EdgeSide& side = sides[s];
    const auto one = points(side);
    const Vector2d along = one[1] - one[0];
    const auto corner = [&](const EdgeSide& at) {
      return shape
          .triangles[static_cast<std::size_t>(at.triangle)][static_cast<std::size_t>(at.corner)];
    };
    const auto third = [&](const EdgeSide& at) {
      return area(shape.corners[static_cast<std::size_t>(at.triangle)]) / 3;
    };
    Edge edge{side.low,
              side.high,
              along.norm(),
              std::atan2(along.y(), along.x()),
              third(side),
              panel_of(shape, static_cast<std::size_t>(side.triangle)),
              {corner(side), -1},
              0,
              0};
    if (s + 1 < sides.size() && sides[s + 1].low == side.low && sides[s + 1].high == side.high) {
      const auto other = points(sides[++s]);
      const Vector2d apart = opposite(other) - opposite(one);
      edge.length = (edge.length + (other[1] - other[0]).norm()) / 2;
      edge.area += third(sides[s]);
      edge.across[1] = corner(sides[s]);
      edge.reach = apart.norm();
      edge.reach_angle = edge.angle + std::atan2(apart.y(), apart.x());
    }
    edges.push_back(edge);
  }
  return edges;
}

// n n : C : n n, what a textile without cross contraction resists stretch in a direction by, N/m.
double stretch_along(const MeasuredTextile& textile, double angle) {
  const double c2 = std::pow(std::cos(angle), 2), s2 = 1 - c2;
  return textile.tensile_warp * c2 * c2 + textile.tensile_weft * s2 * s2 +
         4 * textile.shear * c2 * s2;
}

// The same of bending, N m.
double bend_along(const MeasuredTextile& textile, double angle) {
  const double c2 = std::pow(std::cos(angle), 2), s2 = 1 - c2;
  const double warp = textile.bend_rigidity_warp, weft = textile.bend_rigidity_weft;
  return warp * c2 * c2 + weft * s2 * s2 + (warp + weft) * c2 * s2;
}

// Equal connections are one family.
class Families {
 public:
  Families(const ChoiKo& law, Mesh& mesh) : law_(law), mesh_(mesh) {}

  void stretch(int i, int j, double length, double stiffness) {
    family(FamilyKind::kStretch, length, stiffness, 0).connections.add(i, j);
  }
  void bend(int i, int j, double length, double bend, double clamp) {
    family(FamilyKind::kBend, length, bend, clamp).connections.add(i, j);
  }

 private:
  Family& family(FamilyKind kind, double length, double constant, double clamp) {
    const auto [found, added] =
        known_.try_emplace({kind, length, constant, clamp}, mesh_.families.size());
    if (added) {
      const bool bends = kind == FamilyKind::kBend;
      Family& made =
          mesh_.families.emplace_back(Family{kind, length, bends ? 0 : constant, std::nullopt, {}});
      if (bends && constant > 0 && clamp > 0)
        made.bend = BendingForce(law_, constant, clamp, length);
    }
    return mesh_.families[found->second];
  }

  const ChoiKo& law_;
  Mesh& mesh_;
  std::map<std::tuple<FamilyKind, double, double, double>, std::size_t> known_;
};

// Shares of an even textile on equilateral triangles, whose three directions hold 9/8 of one: 3 of
// the area of an edge, times 8/9. An interlaced connection stores three quarters of its k_b L.
constexpr double kShare = 8.0 / 3;

}  // namespace

ConnectionError add_connections(const SheetDefinition& sheet, const RestShape& shape, Mesh& mesh) {
  Families families(std::get<ChoiKo>(sheet.bending), mesh);
  constexpr int kDirections = 13;
  std::array<double, kDirections> bent{}, should_bend{}, stretched{}, should_stretch{};
  for (const Edge& edge : edges_with_triangles(shape)) {
    const Textile& textile = textile_of(sheet, edge.panel);
    if (const auto* raw = std::get_if<RawTextile>(&textile.model)) {
      families.stretch(edge.i, edge.j, edge.length, raw->stretch);
      if (edge.across[1] >= 0)
        families.bend(edge.across[0], edge.across[1], edge.reach, raw->bend,
                      raw->clamp.value_or(raw->stretch));
      continue;
    }
    const auto& measured = std::get<MeasuredTextile>(textile.model);
    const double stiffness =
        kShare * stretch_along(measured, edge.angle) * edge.area / (edge.length * edge.length);
    families.stretch(edge.i, edge.j, edge.length, stiffness);
    double bend = 0;
    if (edge.across[1] >= 0) {
      bend = 4.0 / 3 * kShare * bend_along(measured, edge.reach_angle) * edge.area / edge.reach;
      const double clamp = 4 * kShare * stretch_along(measured, edge.reach_angle) * edge.area /
                           (edge.reach * edge.reach);
      families.bend(edge.across[0], edge.across[1], edge.reach, bend, clamp);
    }
    for (int k = 0; k < kDirections; ++k) {
      const double angle = k * std::numbers::pi / (2 * (kDirections - 1));
      const auto at = static_cast<std::size_t>(k);
      stretched[at] +=
          stiffness * edge.length * edge.length * std::pow(std::cos(edge.angle - angle), 4);
      should_stretch[at] += stretch_along(measured, angle) * edge.area;
      bent[at] += 0.75 * bend * edge.reach * std::pow(std::cos(edge.reach_angle - angle), 4);
      should_bend[at] += bend_along(measured, angle) * edge.area;
    }
  }
  ConnectionError error;
  const auto range = [](const auto& is, const auto& should, double& least, double& most) {
    for (std::size_t k = 0; k < is.size(); ++k) {
      if (should[k] == 0) continue;
      const double ratio = is[k] / should[k];
      least = least == 0 ? ratio : std::min(least, ratio);
      most = std::max(most, ratio);
    }
  };
  range(bent, should_bend, error.least_bend, error.most_bend);
  range(stretched, should_stretch, error.least_stretch, error.most_stretch);
  return error;
}

}  // namespace weft

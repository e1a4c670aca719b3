#include "core/triangles/folds.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <utility>

#include "core/triangles/fit.h"

namespace weft {
namespace {

std::map<Connection, double> angles_of(const std::vector<Fold>& folds) {
  std::map<Connection, double> angles;
  for (const Fold& fold : folds)
    for (std::size_t k = 0; k + 1 < fold.particles.size(); ++k)
      angles[std::minmax(fold.particles[k], fold.particles[k + 1])] = fold.angle;
  return angles;
}

// A triangle at an edge, which begins at its corner.
struct FoldSide {
  std::size_t triangle, corner;
};

std::map<Connection, std::vector<FoldSide>> sides_of(const RestShape& shape,
                                                     const std::map<Connection, double>& angles) {
  std::map<Connection, std::vector<FoldSide>> sides;
  for (std::size_t t = 0; t < shape.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const Connection edge = std::minmax(shape.triangles[t][k], shape.triangles[t][(k + 1) % 3]);
      if (angles.contains(edge)) sides[edge].push_back({t, k});
    }
  return sides;
}

// Of a panel that is bent about an edge whose direction in it is given, N m.
double rigidity_about(const Vector2d& edge, const BendStiffness& bend) {
  const Vector2d along = edge.normalized();
  const double warp = along.y() * along.y(), weft = along.x() * along.x();  // of the curvature
  return bend.warp * warp * warp + bend.weft * weft * weft + 2 * bend.twist * warp * weft;
}

// The shape cut open along edges: particles that it parts have others beside them, behind all.
struct CutShape {
  RestShape shape;
  std::vector<int> original;  // which particle each is
};

CutShape cut_along(const RestShape& shape, const std::map<Connection, double>& edges) {
  CutShape cut{shape, {}};
  cut.original.resize(static_cast<std::size_t>(shape.particles));
  std::iota(cut.original.begin(), cut.original.end(), 0);
  std::vector<int> on_edges;
  for (const auto& [edge, angle] : edges) {
    on_edges.push_back(edge.first);
    on_edges.push_back(edge.second);
  }
  std::sort(on_edges.begin(), on_edges.end());
  on_edges.erase(std::unique(on_edges.begin(), on_edges.end()), on_edges.end());
  const Corners corners(shape);
  for (const int i : on_edges) {
    const auto count = static_cast<std::size_t>(corners.end(i) - corners.begin(i));
    const auto at = [&](std::size_t n) { return corners.begin(i)[n]; };
    const auto others = [&](std::size_t n) {
      const auto& triangle = shape.triangles[static_cast<std::size_t>(at(n).triangle)];
      const auto k = static_cast<std::size_t>(at(n).corner);
      return std::array{triangle[(k + 1) % 3], triangle[(k + 2) % 3]};
    };
    std::vector<int> piece(count, -1);
    for (std::size_t first = 0, pieces = 0; first < count; ++first) {
      if (piece[first] >= 0) continue;
      int as = i;
      if (pieces++ > 0) {
        as = cut.shape.particles++;
        cut.original.push_back(i);
      }
      std::vector<std::size_t> next = {first};
      piece[first] = as;
      while (!next.empty()) {
        const std::size_t n = next.back();
        next.pop_back();
        cut.shape.triangles[static_cast<std::size_t>(at(n).triangle)]
                           [static_cast<std::size_t>(at(n).corner)] = as;
        for (const int j : others(n)) {
          if (edges.contains(std::minmax(i, j))) continue;
          for (std::size_t m = 0; m < count; ++m)
            if (const auto beside = others(m); piece[m] < 0 && std::ranges::count(beside, j) > 0) {
              piece[m] = as;
              next.push_back(m);
            }
        }
      }
    }
  }
  return cut;
}

}  // namespace

std::vector<Hinge> make_hinges(const RestShape& shape, const std::vector<Fold>& folds,
                               const std::vector<BendStiffness>& bend) {
  if (folds.empty()) return {};
  const std::map<Connection, double> angles = angles_of(folds);
  std::vector<Hinge> hinges;
  for (const auto& [edge, sides] : sides_of(shape, angles)) {
    Hinge hinge;
    hinge.angle = angles.at(edge);
    double length = 0, softness = 0;
    for (std::size_t s = 0; s < 2; ++s) {
      const auto [t, k] = sides[s];
      const auto& corner = shape.corners[t];
      const Vector2d along = corner[(k + 1) % 3] - corner[k], up = corner[(k + 2) % 3] - corner[k];
      length = along.norm();
      const double slope = length / (2 * area(corner)), share = up.dot(along) / (length * length);
      if (s == 0) hinge.particle = {shape.triangles[t][k], shape.triangles[t][(k + 1) % 3], 0, 0};
      hinge.particle[2 + s] = shape.triangles[t][(k + 2) % 3];
      hinge.slope[2 + s] = slope;
      const double at_first = s == 0 ? 1 - share : share;
      hinge.slope[0] -= at_first * slope;
      hinge.slope[1] -= (1 - at_first) * slope;
      softness += kFoldWidth / 2 /
                  rigidity_about(along, bend[static_cast<std::size_t>(panel_of(shape, t))]);
    }
    hinge.stiffness = length / softness;
    if (hinge.stiffness > 0) hinges.push_back(hinge);
  }
  return hinges;
}

std::vector<CurvatureFit> fit_curvature(const RestShape& shape, const std::vector<Fold>& folds) {
  if (folds.empty()) return fit_curvature(shape);
  const CutShape cut = cut_along(shape, angles_of(folds));
  std::vector<CurvatureFit> fits = fit_curvature(cut.shape);
  for (CurvatureFit& fit : fits)
    for (int& i : fit.particle) i = cut.original[static_cast<std::size_t>(i)];
  return fits;
}

}  // namespace weft

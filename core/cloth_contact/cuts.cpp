#include "core/cloth_contact/cuts.h"

#include <algorithm>
#include <array>
#include <limits>
#include <tuple>

#include "core/cloth_contact/orientation.h"

namespace weft {
namespace {

using Triangle = std::array<int, 3>;

// Between which all of some points lie along a way, whatever rounding does.
struct Heights {
  double low, high;
};
template <std::size_t N>
Heights heights(const Vector3d& way, const std::array<Vector3d, N>& points) {
  constexpr double kError = 1e-15;  // above 5 * 2^-53: of points as differences, products and sums
  const Vector3d size = kError * way.cwiseAbs();
  Heights found{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const Vector3d& point : points) {
    const double height = way.dot(point), error = size.dot(point.cwiseAbs());
    found = {std::min(found.low, height - error), std::max(found.high, height + error)};
  }
  return found;
}

// Whether a plane shows that no edge of one goes through the other, but those at a particle of
// both, which none does; false where that takes a closer look.
bool lie_apart(const Triangle& one, const Triangle& other, const Matrix3Xd& x) {
  std::size_t shared = 0, from = 0, from_other = 0;
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t l = 0; l < 3; ++l)
      if (one[k] == other[l]) ++shared, from = k, from_other = l;
  if (shared > 1) return true;
  const auto ways = [&](const Triangle& triangle, std::size_t corner) {
    const auto origin = x.col(triangle[corner]);
    return std::array<Vector3d, 2>{x.col(triangle[(corner + 1) % 3]) - origin,
                                   x.col(triangle[(corner + 2) % 3]) - origin};
  };
  const std::array<Vector3d, 2> sides = ways(one, from), others = ways(other, from_other);
  if (shared == 1) {
    const Vector3d between = sides[0] + sides[1] - others[0] - others[1];
    return heights(between, sides).low > 0 && heights(between, others).high < 0;
  }
  std::array<Vector3d, 3> there;
  for (std::size_t k = 0; k < 3; ++k) there[k] = x.col(other[k]) - x.col(one[0]);
  const auto separates = [&](const Vector3d& way) {
    const Heights own = heights(way, sides), away = heights(way, there);
    return away.low > std::max(own.high, 0.0) || away.high < std::min(own.low, 0.0);
  };
  return separates(sides[0].cross(sides[1])) || separates(others[0].cross(others[1])) ||
         separates(there[0] + there[1] + there[2] - sides[0] - sides[1]);
}

}  // namespace

ClothCuts count_cuts(const std::vector<SheetDefinition>& sheets, const std::vector<Matrix3Xd>& x,
                     std::size_t most_told) {
  const Cloth cloth(sheets);
  const Matrix3Xd all = cloth.positions(x);
  NearBlocks near(cloth);
  near.set(all);
  return count_cuts(cloth, near, all, most_told);
}

std::vector<ClothPair> find_cuts(const Cloth& cloth, NearBlocks& near, const Matrix3Xd& x,
                                 ThreadPool& pool) {
  const auto look = [&](int edges_of, int triangle, std::vector<ClothPair>& found) {
    const auto& [a, b, c] = cloth.triangles[static_cast<std::size_t>(triangle)];
    const Eigen::Array3d low = x.col(a).cwiseMin(x.col(b)).cwiseMin(x.col(c)),
                         high = x.col(a).cwiseMax(x.col(b)).cwiseMax(x.col(c));
    const auto beside = [&](int p, int q) {
      return (x.col(p).array().max(x.col(q).array()) < low).any() ||
             (x.col(p).array().min(x.col(q).array()) > high).any();
    };
    const auto from = static_cast<std::size_t>(edges_of);
    for (int e = cloth.first_edge[from]; e < cloth.first_edge[from + 1]; ++e) {
      const auto& [p, q] = cloth.edges[static_cast<std::size_t>(e)];
      if (p == a || p == b || p == c || q == a || q == b || q == c) continue;
      if (beside(p, q)) continue;
      if (cuts(x.col(p), x.col(q), x.col(a), x.col(b), x.col(c))) found.push_back({e, triangle});
    }
  };
  const std::vector<BlockPair> all = near.meet(0);
  constexpr int kLeastShare = 64;
  const auto find = [&](std::int64_t begin, std::int64_t end, std::vector<ClothPair>& found) {
    NearBlocks::Search search;
    for (std::int64_t k = begin; k < end; ++k) {
      const BlockPair& blocks = all[static_cast<std::size_t>(k)];
      if (near.distance(blocks) > 0) continue;
      for (const auto& [one, other] : near.near_triangles(blocks, 0, search)) {
        if (lie_apart(cloth.triangles[static_cast<std::size_t>(one)],
                      cloth.triangles[static_cast<std::size_t>(other)], x))
          continue;
        look(one, other, found);
        look(other, one, found);
      }
    }
  };
  return find_in_shares<ClothPair>(pool, std::ssize(all), kLeastShare, find);
}

ClothCuts count_cuts(const Cloth& cloth, NearBlocks& near, const Matrix3Xd& x,
                     std::size_t most_told) {
  std::vector<ClothCut> found;
  for (const auto& [edge, triangle] : find_cuts(cloth, near, x)) {
    const auto& [p, q] = cloth.edges[static_cast<std::size_t>(edge)];
    const auto& [a, b, c] = cloth.triangles[static_cast<std::size_t>(triangle)];
    found.push_back({static_cast<std::size_t>(cloth.sheet_of(p)),
                     static_cast<std::size_t>(cloth.sheet_of(a)),
                     {cloth.own_number(p), cloth.own_number(q)},
                     {cloth.own_number(a), cloth.own_number(b), cloth.own_number(c)}});
  }

  const auto told = found.begin() + static_cast<std::ptrdiff_t>(std::min(most_told, found.size()));
  std::partial_sort(found.begin(), told, found.end(), [](const ClothCut& s, const ClothCut& t) {
    return std::tie(s.edge_sheet, s.edge, s.triangle_sheet, s.triangle) <
           std::tie(t.edge_sheet, t.edge, t.triangle_sheet, t.triangle);
  });
  return {static_cast<std::int64_t>(found.size()), {found.begin(), told}};
}

}  // namespace weft

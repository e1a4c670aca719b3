#include "core/cloth_contact/cuts.h"

#include <algorithm>
#include <tuple>

#include "core/cloth_contact/orientation.h"

namespace weft {

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

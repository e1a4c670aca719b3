#include "core/cloth_contact/pairs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/cloth_contact/pair_batch.h"
#include "core/contact/nearest.h"

namespace weft {
namespace {

const std::array<int, 3>& corners_of(const Cloth& cloth, int triangle) {
  return cloth.triangles[static_cast<std::size_t>(triangle)];
}
const std::array<int, 2>& ends_of(const Cloth& cloth, int edge) {
  return cloth.edges[static_cast<std::size_t>(edge)];
}
double thickness_at(const Cloth& cloth, int particle) {
  return cloth.thickness[static_cast<std::size_t>(particle)];
}

// Half of one sheet's thickness and half of the other's; on one sheet the smaller one.
double thickness_between(const Cloth& cloth, int one, double one_thickness, int other,
                         double other_thickness) {
  return cloth.sheet_of(one) == cloth.sheet_of(other) ? std::min(one_thickness, other_thickness)
                                                      : (one_thickness + other_thickness) / 2;
}

// Both without branches, which nothing foretells.
bool share_end(const std::array<int, 2>& one, const std::array<int, 2>& other) {
  const auto& [a, b] = one;
  const auto& [c, d] = other;
  return (a == c) | (a == d) | (b == c) | (b == d);
}
bool has(const std::array<int, 3>& triangle, int particle) {
  const auto& [a, b, c] = triangle;
  return (a == particle) | (b == particle) | (c == particle);
}

std::array<int, 4> particles_of_corner(const Cloth& cloth, const ClothPair& pair) {
  const auto& [a, b, c] = corners_of(cloth, pair.second);
  return {pair.first, a, b, c};
}
std::array<int, 4> particles_of_edges(const Cloth& cloth, const ClothPair& pair) {
  const auto& [a, b] = ends_of(cloth, pair.first);
  const auto& [c, d] = ends_of(cloth, pair.second);
  return {a, b, c, d};
}

// Calls f(pair, its squared distance at x, m^2) for all pairs of a kind that are added, in their
// order, until it is finished.
template <class Pair, class F>
class Distances {
 public:
  Distances(bool edges, const Matrix3Xd& x, const F& f) : batch_(edges, x), f_(f) {}

  void add(const Pair& pair, const std::array<int, 4>& particles) { add_if(true, pair, particles); }
  // Without branches, which nothing foretells.
  void add_if(bool wanted, const Pair& pair, const std::array<int, 4>& particles) {
    pairs_[batch_.size()] = pair;
    batch_.add_if(wanted, particles);
    if (batch_.full()) finish();
  }
  void finish() {
    batch_.solve();
    for (std::size_t n = 0; n < batch_.size(); ++n) f_(pairs_[n], batch_.squared(n));
    batch_.clear();
  }

 private:
  PairBatch batch_;
  const F& f_;
  std::array<Pair, PairBatch::kMost> pairs_;
};

// Keeps a pair if it is nearer than its thickness and `reach`, else lowers `reach_of_others` to
// what keeps it so, m.
template <class Pair>
void keep_nearer(const Pair& pair, double squared, double thickness, double reach,
                 std::vector<Pair>& kept, double& reach_of_others) {
  const double within = thickness + reach, others = thickness + reach_of_others;
  if (within > 0 && squared < within * within)
    kept.push_back(pair);
  else if (squared < others * others)
    reach_of_others = std::sqrt(squared) - thickness;
}

// Whether they come within `reach` of each other along every axis.
bool boxes_meet(const Vector3d& low, const Vector3d& high, const Vector3d& other_low,
                const Vector3d& other_high, double reach) {
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    if (other_low[axis] - high[axis] >= reach || low[axis] - other_high[axis] >= reach)
      return false;
  return true;
}

}  // namespace

Candidates candidates_of(const Cloth& cloth, const ClothPairs& pairs) {
  Candidates made;
  made.corners.reserve(pairs.corners.size());
  made.edges.reserve(pairs.edges.size());
  for (const ClothPair& pair : pairs.corners)
    made.corners.push_back(
        {particles_of_corner(cloth, pair), thickness_of_corner(cloth, pair.first, pair.second)});
  for (const ClothPair& pair : pairs.edges)
    made.edges.push_back(
        {particles_of_edges(cloth, pair), thickness_of_edges(cloth, pair.first, pair.second)});
  return made;
}

void nearer(const Candidates& candidates, const Matrix3Xd& x, double reach, Candidates& near,
            double& reach_of_others) {
  for (const bool edges : {false, true}) {
    std::vector<Candidate>& to = edges ? near.edges : near.corners;
    to.clear();
    const auto keep = [&](const Candidate* candidate, double squared) {
      keep_nearer(*candidate, squared, candidate->thickness, reach, to, reach_of_others);
    };
    Distances<const Candidate*, decltype(keep)> distances(edges, x, keep);
    for (const Candidate& candidate : edges ? candidates.edges : candidates.corners)
      distances.add(&candidate, candidate.particle);
    distances.finish();
  }
}

double thickness_of_corner(const Cloth& cloth, int particle, int triangle) {
  const auto& [a, b, c] = corners_of(cloth, triangle);
  const double least =
      std::min({thickness_at(cloth, a), thickness_at(cloth, b), thickness_at(cloth, c)});
  return thickness_between(cloth, particle, thickness_at(cloth, particle), a, least);
}

double thickness_of_edges(const Cloth& cloth, int one, int other) {
  const auto& [a, b] = ends_of(cloth, one);
  const auto& [c, d] = ends_of(cloth, other);
  return thickness_between(cloth, a, std::min(thickness_at(cloth, a), thickness_at(cloth, b)), c,
                           std::min(thickness_at(cloth, c), thickness_at(cloth, d)));
}

bool near_corner(const Cloth& cloth, const Matrix3Xd& x, int particle, int triangle, double reach) {
  const auto& [i, j, k] = corners_of(cloth, triangle);
  const double within = thickness_of_corner(cloth, particle, triangle) + reach;
  const Vector3d p = x.col(particle), a = x.col(i), b = x.col(j), c = x.col(k);
  if (!boxes_meet(p, p, a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c), within)) return false;
  const auto [u, v, w] = nearest_in_triangle(p, a, b, c);
  return (p - u * a - v * b - w * c).squaredNorm() < within * within;
}

bool near_edges(const Cloth& cloth, const Matrix3Xd& x, int one, int other, double reach) {
  const auto& [i, j] = ends_of(cloth, one);
  const auto& [k, l] = ends_of(cloth, other);
  const double within = thickness_of_edges(cloth, one, other) + reach;
  const Vector3d a = x.col(i), b = x.col(j), c = x.col(k), d = x.col(l);
  if (!boxes_meet(a.cwiseMin(b), a.cwiseMax(b), c.cwiseMin(d), c.cwiseMax(d), within)) return false;
  const auto [s, t] = nearest_on_edges(a, b, c, d);
  return (a + s * (b - a) - c - t * (d - c)).squaredNorm() < within * within;
}

std::map<BlockPair, ClothPairs> all_pairs(const Cloth& cloth) {
  std::vector<int> particle_block(static_cast<std::size_t>(cloth.particles())), edge_block;
  const int blocks = static_cast<int>(cloth.first_block.size()) - 1;
  for (int b = 0; b < blocks; ++b) {
    const auto first = static_cast<std::size_t>(cloth.first_block[static_cast<std::size_t>(b)]),
               last = static_cast<std::size_t>(cloth.first_block[static_cast<std::size_t>(b) + 1]);
    edge_block.resize(static_cast<std::size_t>(cloth.first_edge[last]), b);
    for (int k = cloth.first_corner[first]; k < cloth.first_corner[last]; ++k)
      particle_block[static_cast<std::size_t>(cloth.corners[static_cast<std::size_t>(k)])] = b;
  }
  std::map<BlockPair, ClothPairs> lists;
  const auto list = [&](int one, int other) -> ClothPairs& {
    return lists[{std::min(one, other), std::max(one, other)}];
  };
  for (int i = 0; i < cloth.particles(); ++i)
    for (int b = 0, t = 0; b < blocks; ++b)
      for (; t < cloth.first_block[static_cast<std::size_t>(b) + 1]; ++t)
        if (!has(corners_of(cloth, t), i))
          list(particle_block[static_cast<std::size_t>(i)], b).corners.push_back({i, t});
  const int edges = static_cast<int>(cloth.edges.size());
  for (int e = 0; e < edges; ++e)
    for (int f = e + 1; f < edges; ++f)
      if (!share_end(ends_of(cloth, e), ends_of(cloth, f)))
        list(edge_block[static_cast<std::size_t>(e)], edge_block[static_cast<std::size_t>(f)])
            .edges.push_back({e, f});
  return lists;
}

ClothPairs find_pairs(const Cloth& cloth, NearBlocks& near, const BlockPair& blocks,
                      const Matrix3Xd& x, double reach, double& reach_of_others,
                      NearBlocks::Search& search) {
  ClothPairs found;
  const double boxes_within = cloth.thickest + reach_of_others;
  const auto is_far = [&](double squared) {
    const double within = cloth.thickest + reach_of_others;
    return !(squared < within * within);
  };
  const auto keep_corner = [&](const ClothPair& pair, double squared) {
    if (is_far(squared)) return;
    keep_nearer(pair, squared, thickness_of_corner(cloth, pair.first, pair.second), reach,
                found.corners, reach_of_others);
  };
  Distances<ClothPair, decltype(keep_corner)> corners(false, x, keep_corner);
  const auto add_corners = [&](int one, int other) {
    for (const ClothPair& pair : near.near_corners(one, other, boxes_within, search))
      corners.add_if(!has(corners_of(cloth, pair.second), pair.first), pair,
                     particles_of_corner(cloth, pair));
  };
  add_corners(blocks.one, blocks.other);
  if (blocks.one != blocks.other) add_corners(blocks.other, blocks.one);
  corners.finish();
  const auto keep_edges = [&](const ClothPair& pair, double squared) {
    if (is_far(squared)) return;
    keep_nearer(pair, squared, thickness_of_edges(cloth, pair.first, pair.second), reach,
                found.edges, reach_of_others);
  };
  Distances<ClothPair, decltype(keep_edges)> edges(true, x, keep_edges);
  for (const ClothPair& pair : near.near_edges(blocks, boxes_within, search))
    edges.add_if(!share_end(ends_of(cloth, pair.first), ends_of(cloth, pair.second)), pair,
                 particles_of_edges(cloth, pair));
  edges.finish();
  std::sort(found.corners.begin(), found.corners.end());
  std::sort(found.edges.begin(), found.edges.end());
  return found;
}

}  // namespace weft

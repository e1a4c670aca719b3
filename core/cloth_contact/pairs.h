#pragma once

#include <array>
#include <map>
#include <vector>

#include "core/cloth_contact/near_blocks.h"

namespace weft {

// Pairs of cloth that share no particle, in ascending order.
struct ClothPairs {
  std::vector<ClothPair> corners;  // particles and triangles
  std::vector<ClothPair> edges;

  bool empty() const { return corners.empty() && edges.empty(); }
  bool operator==(const ClothPairs&) const = default;
};

// A pair by its particles: one and the corners of a triangle, or the ends of two edges.
struct Candidate {
  std::array<int, 4> particle;
  double thickness;  // at which it is kept apart, m
};
struct Candidates {
  std::vector<Candidate> corners, edges;

  bool empty() const { return corners.empty() && edges.empty(); }
};

Candidates candidates_of(const Cloth& cloth, const ClothPairs& pairs);
// Leaves in `near` those that are nearer to each other at x, (3 x particles) m, than their
// thickness and `reach`, m; lowers `reach_of_others` to what keeps the others so, m.
void nearer(const Candidates& candidates, const Matrix3Xd& x, double reach, Candidates& near,
            double& reach_of_others);

// The distance at which cloth keeps these apart, m.
double thickness_of_corner(const Cloth& cloth, int particle, int triangle);
double thickness_of_edges(const Cloth& cloth, int one, int other);

// Whether they are nearer to each other at x, (3 x particles) m, than their thickness and `reach`,
// m.
bool near_corner(const Cloth& cloth, const Matrix3Xd& x, int particle, int triangle, double reach);
bool near_edges(const Cloth& cloth, const Matrix3Xd& x, int one, int other, double reach);

// All pairs there are, one list for each two blocks, in their order.
std::map<BlockPair, ClothPairs> all_pairs(const Cloth& cloth);

// Those between two blocks, at x where `near` has its boxes, that are nearer to each other than
// their thickness and `reach`, m; lowers `reach_of_others`, from `reach` on, to what keeps the
// others so, m.
ClothPairs find_pairs(const Cloth& cloth, NearBlocks& near, const BlockPair& blocks,
                      const Matrix3Xd& x, double reach, double& reach_of_others,
                      NearBlocks::Search& search);

}  // namespace weft

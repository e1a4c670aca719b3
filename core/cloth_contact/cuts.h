#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/cloth_contact/pairs.h"
#include "core/model/mesh.h"

namespace weft {

// An edge of cloth that passes through a triangle of cloth, by sheets and their particles.
struct ClothCut {
  std::size_t edge_sheet = 0, triangle_sheet = 0;
  std::array<int, 2> edge{};
  std::array<int, 3> triangle{};
};

// Where sheets pass through themselves and each other.
struct ClothCuts {
  std::int64_t count = 0;
  // in the order of sheets and particles, at most so many as asked for
  std::vector<ClothCut> first;
};

// Counts them exactly (orientation.h), without edges that share a particle with the triangle.
// x: positions of each sheet, (3 x particles) m.
ClothCuts count_cuts(const std::vector<SheetDefinition>& sheets, const std::vector<Matrix3Xd>& x,
                     std::size_t most_told = 10);
// Edges and triangles that they pass through, of cloth at x, where its blocks are.
std::vector<ClothPair> find_cuts(const Cloth& cloth, NearBlocks& near, const Matrix3Xd& x,
                                 ThreadPool& pool = calling_thread());
// Of the same.
ClothCuts count_cuts(const Cloth& cloth, NearBlocks& near, const Matrix3Xd& x,
                     std::size_t most_told);

}  // namespace weft

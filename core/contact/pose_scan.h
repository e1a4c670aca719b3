#pragma once

#include <hwy/aligned_allocator.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/model/body.h"

namespace weft {

// The nearest triangles of corners of cells, block by block: 4 x 4 x 4 corners, x before y before
// z.
struct ScannedBlock {
  static constexpr int kLayer = 16, kCorners = 64;
  alignas(64) float squared[kCorners];  // of the distance, m^2
  // The nearest place of the triangle: corner + v ab + w ac.
  alignas(64) float v[kCorners], w[kCorners];
  alignas(64) std::int32_t triangle[kCorners];  // -1: none is near
};

// A triangle on its way past the corners near it, which are those from `first` to `last`.
struct ScannedTriangle {
  std::int32_t number = 0;
  std::array<int, 3> first{}, last{};  // in cells
  Vector3d corner, ab, ac;             // m
  Vector3d middle;                     // of a ball around it, m
  double reach = 0;                    // from there to what is near it, m
};

// Every corner of a layer that has one of them meets each triangle, in order. begin: of each block
// in `blocks`, -1 where it has none, x before y before z; low: the first corner, m; cell: m.
void scan(std::span<const ScannedTriangle> triangles, const Vector3d& low, double cell,
          const std::array<int, 3>& counts, std::span<const std::int32_t> begin,
          std::span<ScannedBlock> blocks);

}  // namespace weft

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace weft {

using Eigen::Vector3d;

// A surface of triangles, anticlockwise seen from outside.
struct BodyMesh {
  std::vector<Vector3d> vertices;  // m
  std::vector<std::array<int, 3>> triangles;
};

// Signed distances from a surface at the corners of cells, negative inside; between corners they
// are trilinear. Cells lie in blocks, and each block has all of its corners, x before y before z:
// near the surface those of its cells, deep inside the eight of the block; where the block is
// farther outside than `reach`, eight equal values that none of its corners is nearer than.
struct DistanceGrid {
  static constexpr int kBlock = 4;  // cells along an edge of a block
  // By how much the values grow in a metre, at most: by one along each axis.
  static constexpr double kSteepest = 1.7320508075688772;

  Vector3d low = Vector3d::Zero();  // corner of the first block, m
  double cell = 0;                  // edge of a cell, m
  double reach = 0;                 // from the surface outside, m
  std::array<int, 3> blocks{};      // along each axis; beyond them nothing is nearer than `reach`
  std::vector<std::int32_t> begin;  // of the values of each block, ~begin where it has but eight
  std::vector<float> values;        // m
};

// A closed mesh with the distances from it: large, and never changed.
struct Body {
  BodyMesh mesh;
  DistanceGrid grid;
  double thickness = 0;            // where it is thinnest, m
  int thinnest = 0;                // triangle there
  std::vector<std::string> notes;  // what was mended
};

}  // namespace weft

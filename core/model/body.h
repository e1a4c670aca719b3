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

// Positions of all vertices at given times, linear between, constant outside: large, and never
// changed.
struct Poses {
  std::vector<double> times;     // s, rising
  std::vector<float> positions;  // m: of each pose x of all vertices, then y, then z
  // These follow, see complete().
  std::vector<Vector3d> middles;  // mean of the vertices of each pose, m
  // From each pose to the next: the longest way of a vertex, m, and past that of the middle.
  std::vector<double> ways, own_ways;

  std::size_t vertices() const { return positions.size() / (3 * times.size()); }
  Vector3d position(std::size_t pose, std::size_t vertex) const;
};

// The poses with what follows from them. Precondition: find_problems() finds none.
std::shared_ptr<const Poses> complete(Poses poses);

// Of the fastest vertex between two times, m/s.
double fastest(const Poses& poses, double begin, double end);

// How a hand leads a body through its poses: at one rate, and it stays where that ends.
struct PoseLead {
  double begin = 0, end = 0;  // s
  double from = 0, to = 0;    // s, among the times of the poses
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

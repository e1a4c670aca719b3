#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "core/cloth_contact/cloth.h"

namespace weft {

// How the places of triangles change over their flat shape, kept for vectors.
class Gradients {
 public:
  explicit Gradients(const Cloth& cloth);

  // Of the triangles of a block, where particles are at `places`, (4 x particles) m in single
  // precision.
  void set(int block, const Eigen::Matrix4Xf& places);
  // Of these together, as it was set last.
  const Eigen::Matrix<float, 3, 2>& sum(int block) const {
    return sum_[static_cast<std::size_t>(block)];
  }
  // Of all triangles of these blocks the least and the most along both ways (rows), over u and over
  // v (columns).
  struct Bounds {
    Eigen::Array22f low, high;
  };
  Bounds along(const Eigen::Matrix<float, 3, 2>& ways, std::span<const int> blocks) const;

  // For vectors: eight triangles of a block; where there are fewer the last one again.
  template <class T>
  using Eight = std::array<T, 8>;
  struct alignas(32) Triangles {
    std::array<Eight<int>, 3> corner;
    std::array<std::array<Eight<float>, 2>, 2> inverse;  // of both sides over u, over v, 1/m
    std::size_t count;
  };
  struct alignas(32) Rows {
    std::array<std::array<Eight<float>, 3>, 2> over;  // x, y, z over u, over v
  };

 private:
  std::vector<std::size_t> first_;  // of each block; then how many there are
  std::vector<Triangles> triangles_;
  std::vector<Rows> rows_;
  std::vector<Eigen::Matrix<float, 3, 2>> sum_;  // of each block
};

}  // namespace weft

#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "core/cloth_contact/near_blocks.h"

namespace weft {

// What the particles of each block, and of each node of blocks, moved by from one place to another:
// it lies in a box.
class BlockMotion {
 public:
  explicit BlockMotion(const NearBlocks& blocks);

  // (3 x particles) m
  void set(const Matrix3Xd& from, const Matrix3Xd& to, ThreadPool& pool);
  void forget();

  // How far what is in two nodes, or blocks, moved in relation to each other, at most, m: what both
  // moved by lies in a box around theirs.
  double between(int one, int other) const { return rounded(std::sqrt(squared(one, other))); }
  // The same in two steps, for roots of several can be taken at once.
  float squared(int one, int other) const {
    const Box &a = box_[static_cast<std::size_t>(one)], &b = box_[static_cast<std::size_t>(other)];
    return (a.high.max(b.high) - a.low.min(b.low)).matrix().squaredNorm();
  }
  static double rounded(float root) { return kOfRounding * double{root} + kRounding; }

 private:
  static constexpr double kOfRounding = 1 + 1e-6, kRounding = 1e-12;
  struct Box {
    Eigen::Array4f low, high;
  };
  void box_ways(ThreadPool& pool);

  const NearBlocks& blocks_;
  std::vector<int> joined_;  // nodes with halves, after these
  std::vector<Box> box_;     // of each node
  Places by_;                // m
};

}  // namespace weft

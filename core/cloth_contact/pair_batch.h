#pragma once

#include <array>
#include <cstddef>

#include "core/model/shape.h"

namespace weft {

// Nearest points of many pairs of a particle and a triangle, or of many pairs of edges, side by
// side in vectors.
class PairBatch {
 public:
  static constexpr std::size_t kMost = 64;

  bool full() const { return size_ == kMost; }
  std::size_t size() const { return size_; }
  void clear() { size_ = 0; }
  // A particle and the corners of a triangle, or the ends of two edges, m. Precondition: not full.
  void add(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<Eigen::Index>(axis);
      points_[axis][size_] = a[k];
      points_[3 + axis][size_] = b[k];
      points_[6 + axis][size_] = c[k];
      points_[9 + axis][size_] = d[k];
    }
    ++size_;
  }

  // As nearest_in_triangle() and nearest_on_edges(), of all that were added.
  void solve_corners();
  void solve_edges();

  // Of a pair: weights that lead from the second one's nearest point to the first one's; the way
  // between these, m; its squared length, m^2.
  std::array<double, 4> weights(std::size_t k) const {
    return {weights_[0][k], weights_[1][k], weights_[2][k], weights_[3][k]};
  }
  Vector3d apart(std::size_t k) const { return {apart_[0][k], apart_[1][k], apart_[2][k]}; }
  double squared(std::size_t k) const { return squared_[k]; }

  // Of vectors: kMost values each.
  struct Planes {
    const double (*points)[kMost];
    double (*weights)[kMost];
    double (*apart)[kMost];
    double* squared;
    std::size_t size;
  };

 private:
  Planes planes() { return {points_, weights_, apart_, squared_, size_}; }

  std::size_t size_ = 0;
  alignas(64) double points_[12][kMost] = {};
  alignas(64) double weights_[4][kMost];
  alignas(64) double apart_[3][kMost];
  alignas(64) double squared_[kMost];
};

}  // namespace weft

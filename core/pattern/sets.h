#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

namespace weft {

inline std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

// Sets of numbers that grow together; the least of each stands for it.
class Sets {
 public:
  explicit Sets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int find(int i) {
    while (up(i) != i) i = up(i) = up(up(i));
    return i;
  }
  void join(int i, int j) {
    i = find(i), j = find(j);
    up(std::max(i, j)) = std::min(i, j);
  }

 private:
  int& up(int i) { return parent_[as_index(i)]; }

  std::vector<int> parent_;
};

}  // namespace weft

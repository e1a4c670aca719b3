#include "client/imports/edges.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace weft::client {

std::vector<Side> sides_of(const Triangles& triangles) {
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int from = triangles[t][k], to = triangles[t][(k + 1) % 3];
      sides.push_back({std::min(from, to), std::max(from, to), from < to, static_cast<int>(t),
                       static_cast<int>(k)});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.triangle, a.k) < std::tie(b.low, b.high, b.triangle, b.k);
  });
  return sides;
}

Unions::Unions(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }

int Unions::find(int i) {
  while (parent_[static_cast<std::size_t>(i)] != i) {
    int& up = parent_[static_cast<std::size_t>(i)];
    up = parent_[static_cast<std::size_t>(up)];
    i = up;
  }
  return i;
}

void Unions::join(int i, int j) {
  i = find(i), j = find(j);
  parent_[static_cast<std::size_t>(std::max(i, j))] = std::min(i, j);
}

int Unions::number(std::vector<int>& set_of) {
  set_of.assign(parent_.size(), -1);
  int count = 0;
  for (std::size_t i = 0; i < parent_.size(); ++i) {
    const auto root = static_cast<std::size_t>(find(static_cast<int>(i)));
    set_of[i] = root == i ? count++ : set_of[root];
  }
  return count;
}

}  // namespace weft::client

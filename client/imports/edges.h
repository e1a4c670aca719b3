#pragma once

#include <span>
#include <vector>

#include "client/imports/imported_mesh.h"

namespace weft::client {

// A side of a triangle: from corner k to corner k + 1.
struct Side {
  int low, high;   // its two particles
  bool ascending;  // whether the triangle goes from low to high
  int triangle, k;
};

// All sides, those of one edge one after the other, edges by their particles.
std::vector<Side> sides_of(const Triangles& triangles);

// Calls use(span of sides) for every edge.
template <class Use>
void for_each_edge(const std::vector<Side>& sides, const Use& use) {
  for (std::size_t begin = 0; begin < sides.size();) {
    std::size_t end = begin + 1;
    while (end < sides.size() && sides[end].low == sides[begin].low &&
           sides[end].high == sides[begin].high)
      ++end;
    use(std::span(sides).subspan(begin, end - begin));
    begin = end;
  }
}

// Sets that grow together.
class Unions {
 public:
  explicit Unions(std::size_t count);
  int find(int i);
  void join(int i, int j);
  // The set of each, numbered from 0 as they come; how many.
  int number(std::vector<int>& set_of);

 private:
  std::vector<int> parent_;
};

}  // namespace weft::client

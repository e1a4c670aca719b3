#pragma once

#include <vector>

#include "core/model/body.h"

namespace weft {

// How often a closed surface winds around points, by what crosses parallels to the x axis: 0
// outside, 1 inside, more where it overlaps itself, less than 0 where it is inside out. The
// parallels run through (low.y + j step, low.z + k step).
class WindingNumbers {
 public:
  WindingNumbers(const BodyMesh& mesh, const Vector3d& low, double step, int rows, int layers);

  // Of the point x on parallel (j, k).
  int at(double x, int j, int k) const;

 private:
  struct Crossing {
    double x;    // m
    int change;  // of the winding number beyond it
  };
  std::vector<Crossing> crossings_;  // of each parallel by x, one parallel after the other
  std::vector<std::size_t> begin_;
  int rows_;
};

}  // namespace weft

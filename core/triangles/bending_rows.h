#pragma once

#include <cstddef>
#include <vector>

#include "core/model/mesh.h"
#include "core/triangles/lists.h"

namespace weft {

// Rows of the matrix of the bending energy: N/m by particle, without the diagonal, for rows sum up
// to 0.
class BendingRows {
 public:
  BendingRows(const Surface& surface, int particles);

  struct Entry {
    int particle;
    double stiffness;
  };
  // Of particle i, by particle.
  const std::vector<Entry>& row(int i);

 private:
  struct Use {
    std::size_t fit, at;
  };
  const Surface& surface_;
  Lists<Use> uses_;
  std::vector<double> sum_;
  std::vector<int> known_;
  std::vector<Entry> entries_;
};

}  // namespace weft

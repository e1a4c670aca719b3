#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/model/body.h"
#include "core/model/scene.h"
#include "core/motion/thread_pool.h"

namespace weft {

// Of the grid of a body, m. Absent cells are chosen by the body's surface: a person's are 4 to 5
// mm.
struct BodySettings {
  double cell = 0;   // edge of a cell; 0: chosen
  double reach = 0;  // how far outside contact needs exact values
  // Through poses, where grids are made again and again: chosen cells are half as large again.
  bool moves = false;
};

// A body, or what keeps the mesh from being one; paths begin with `field`.
struct MadeBody {
  std::shared_ptr<const Body> body;
  std::vector<Problem> problems;
};
// The same for any threads.
MadeBody make_body(BodyMesh mesh, const BodySettings& settings, const std::string& field,
                   ThreadPool& pool = calling_thread());

}  // namespace weft

#pragma once

#include <vector>

#include "core/motion/stability.h"
#include "core/plan.h"

namespace weft {

// Adds to a plan what its scene lacks, costs or may do unseen. planned, steps: of its sheets, in
// order.
void warn(const Scene& scene, const std::vector<PlannedSheet>& planned,
          const std::vector<StableStep>& steps, Plan& plan);

}  // namespace weft

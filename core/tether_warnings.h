#pragma once

#include "core/plan.h"

namespace weft {

// What the tethers of a sheet reach, and where they mislead.
void describe_tethers(const Scene& scene, std::size_t index, const PlannedSheet& planned,
                      Plan& plan);

}  // namespace weft

#pragma once

#include <optional>
#include <vector>

#include "core/cloth_contact/cloth.h"
#include "core/plan.h"

namespace weft {

// What is said of sheets that start where cloth contact cannot have put them: through each other,
// or nearer than their thickness. x: positions of each sheet, (3 x particles) m.
std::optional<Warning> find_tangles(const Scene& scene, const std::vector<Matrix3Xd>& x,
                                    const LeftOut& left_out = {});

}  // namespace weft

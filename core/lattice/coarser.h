#pragma once

#include <optional>
#include <vector>

#include "core/model/mesh.h"
#include "core/model/scene.h"

namespace weft {

// The scene as it stands at `time`, with about half as many rows and columns: of textiles alike,
// held and touched by the same, so that it comes to much the same rest in an eighth of the work.
// None where a sheet is no lattice or has few rows or columns, or where what holds or touches it
// cannot be had on fewer particles: cloth contact, bodies through poses. x: positions of each
// sheet, (3 x particles) m.
std::optional<Scene> coarser_scene(const Scene& scene, const std::vector<Matrix3Xd>& x,
                                   double time);

}  // namespace weft

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/model/scene.h"

namespace weft::reports {

// What the cloth of Blender makes of a scene, with self-collision, on one thread.
struct BlenderRun {
  std::vector<double> frames;      // processor time of each, s
  std::vector<std::int64_t> cuts;  // at the end of each, counted as Weft's are
};

// "Blender 3.4.1"; nothing where there is no `blender` to start.
std::optional<std::string> blender_version();

// Sheets of triangles, pins with their paths, colliders with theirs; stretch, shear and density are
// those of the textile, thickness is the sheet's, and the rest has Blender's defaults.
BlenderRun run_blender(const Scene& scene, int frames);

}  // namespace weft::reports

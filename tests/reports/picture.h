#pragma once

#include <filesystem>

#include "core/simulation.h"

namespace weft::reports {

// A picture of the last frame as a WebP file: sheets in colours of their own, and what they meet.
void draw(const Simulation& simulation, const std::filesystem::path& path);

}  // namespace weft::reports

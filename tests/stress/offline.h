#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/simulation.h"
#include "weft/v1/scene.pb.h"

// Frames as the core alone computes them, without a server.
namespace weft::stress {

Simulation simulation_of(const v1::Scene& scene);

// Positions of the frame it is at, as they are sent: FLOAT32 or FLOAT64.
std::string float_planes(const Simulation& simulation);
std::string double_planes(const Simulation& simulation);

inline std::size_t checksum_of(std::string_view planes) {
  return std::hash<std::string_view>{}(planes);
}

// Checksums of the float planes of frames 0 to `last`.
std::vector<std::size_t> offline_checksums(const v1::Scene& scene, std::int64_t last);

}  // namespace weft::stress

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "weft/v1/frame.pb.h"

namespace weft::client {

// Particle positions, m.
struct Points {
  std::vector<double> x, y, z;
};

// A part of a frame as an export writes it.
struct ExportFrame {
  std::int64_t number = 0;
  double time_s = 0;
  Points points;
};

// The particles first, first + 1, ... of the planes of a frame.
Points read_points(const std::string& planes, v1::FrameEncoding encoding, std::size_t first,
                   std::size_t count);

}  // namespace weft::client

#pragma once

#include <string>
#include <vector>

#include "weft/v1/frame.pb.h"

namespace weft::client {

// Particle positions, m.
struct Points {
  std::vector<double> x, y, z;
};

// The particles first, first + 1, ... of the planes of a frame.
Points read_points(const std::string& planes, v1::FrameEncoding encoding, std::size_t first,
                   std::size_t count);
// All of them.
Points read_points(const std::string& planes, v1::FrameEncoding encoding);

}  // namespace weft::client

#pragma once

#include <string>
#include <vector>

#include "weft/v1/frame.pb.h"

namespace weft::client {

// Particle positions, m.
struct Points {
  std::vector<double> x, y, z;
};

// Bytes of an array of the stream's frames. Throws where the header's sheets do not follow each
// other as sheets do, or the format is unknown, or no frame has the number of the first.
std::size_t array_bytes(const v1::StreamHeader& header);

// Whether the arrays of the frame are as long as they should be.
bool is_whole(const v1::Frame& frame, std::size_t array_bytes, bool velocities);

// The particles first, first + 1, ... of the planes of a frame.
Points read_points(const std::string& planes, v1::FrameEncoding encoding, std::size_t first,
                   std::size_t count);
// All of them.
Points read_points(const std::string& planes, v1::FrameEncoding encoding);

}  // namespace weft::client

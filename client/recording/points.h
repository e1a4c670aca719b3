#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "weft/v1/frame.pb.h"

namespace weft::client {

// Particle positions, m.
struct Points {
  std::vector<double> x, y, z;
};

// Particles in the stream's frames. Throws where the header's sheets do not follow each other as
// sheets do, or the format is unknown, or no frame has the number of the first.
std::size_t particle_count(const v1::StreamHeader& header);
// Triangles of all its sheets, which do follow each other so.
std::size_t triangle_count(const v1::StreamHeader& header);

// Whether the arrays of the frame can be read and hold all particles.
bool is_whole(const v1::Frame& frame, const v1::StreamHeader& header);

// The particles first, first + 1, ... of an array of a frame that is whole.
Points read_points(const std::string& array, const v1::StreamHeader& header, std::size_t first,
                   std::size_t count);
// All of them.
Points read_points(const std::string& array, const v1::StreamHeader& header);

// Of every particle, of a frame that is whole; none where its format has none.
std::vector<double> read_pressures(const v1::Frame& frame, const v1::StreamHeader& header);   // Pa
std::vector<double> read_clearances(const v1::Frame& frame, const v1::StreamHeader& header);  // m

}  // namespace weft::client

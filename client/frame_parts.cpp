#include "client/frame_parts.h"

#include <fmt/format.h>

#include "client/problem.h"
#include "client/recording/points.h"

namespace weft::client {

void FrameParts::begin(const v1::StreamHeader& header) {
  constexpr std::size_t kMostArrays = 3, kMostBytes = 3 * sizeof(double);
  most_bytes_ = 1024 + 2 * kMostArrays * kMostBytes * particle_count(header);
  frame_.Clear();
}

bool FrameParts::join(v1::Frame& part) {
  if (frame_.continued()) {
    const std::size_t bytes = frame_.ByteSizeLong() + part.ByteSizeLong();
    if (part.number() != frame_.number() || bytes > most_bytes_) {
      throw Problem(
          Exit::kRefused, "INTERNAL", "FRAME_INCOMPLETE",
          fmt::format("the server sent parts of frame {} that make no frame", frame_.number()));
    }
    frame_.mutable_positions_m()->append(part.positions_m());
    frame_.mutable_velocities_m_per_s()->append(part.velocities_m_per_s());
    frame_.mutable_normals()->append(part.normals());
    frame_.set_continued(part.continued());
    part.Swap(&frame_);
  }
  if (!part.continued()) return true;
  frame_.Swap(&part);
  return false;
}

}  // namespace weft::client

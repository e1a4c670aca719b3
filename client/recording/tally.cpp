#include "client/recording/tally.h"

#include <algorithm>

namespace weft::client {

void Tally::add(const v1::Frame& frame) {
  if (frames == 0) {
    first_frame = frame.number();
    first_time_s = frame.time_s();
  }
  ++frames;
  last_frame = frame.number();
  last_time_s = frame.time_s();
  substeps += frame.stats().substep_count();
  repairs += frame.stats().repair_count();
  largest_strain = std::max(largest_strain, frame.stats().largest_strain());
  if (frame.stats().has_cloth_cut_count())
    most_cuts = std::max(most_cuts.value_or(0), frame.stats().cloth_cut_count());
  bytes +=
      static_cast<std::int64_t>(frame.positions_m().size() + frame.velocities_m_per_s().size());
  last_stats = frame.stats();
}

}  // namespace weft::client

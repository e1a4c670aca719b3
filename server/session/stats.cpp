#include "server/session/stats.h"

namespace weft {

void DurationHistogram::add(std::chrono::duration<double> duration) {
  std::size_t bucket = 0;
  while (bucket + 1 < kBuckets && duration.count() > bound(bucket)) ++bucket;
  ++counts_[bucket];
  nanoseconds_ += std::chrono::duration_cast<std::chrono::nanoseconds>(duration).count();
}

}  // namespace weft

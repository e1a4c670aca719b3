#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace weft::client {

// Times, counted in buckets as HdrHistogram does: each is known within 0.8 % or 1 ns, and an hour
// of frames takes no more memory than a second of them.
class Latencies {
 public:
  // Seconds; what is below 0 counts as 0. `count` times.
  void add(double seconds, std::int64_t count = 1);

  std::int64_t count() const { return count_; }
  // The smallest time, s, that `fraction` of all do not exceed, 0 to 1; 0 where there is none.
  double quantile(double fraction) const;

 private:
  std::vector<std::int64_t> buckets_;
  std::int64_t count_ = 0;
  double largest_ = 0;  // s
};

}  // namespace weft::client

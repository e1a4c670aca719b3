#include "client/load/latencies.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace weft::client {
namespace {

// Every power of two of nanoseconds has 128 buckets.
constexpr int kBucketBits = 7;
constexpr std::uint64_t kBuckets = std::uint64_t{1} << kBucketBits;

std::size_t bucket_of(std::uint64_t ns) {
  const int shift = std::max(0, static_cast<int>(std::bit_width(ns)) - kBucketBits - 1);
  return static_cast<std::size_t>(shift) * kBuckets + (ns >> shift);
}

// Largest time of a bucket, s.
double end_of(std::size_t bucket) {
  const int shift = std::max(0, static_cast<int>(bucket / kBuckets) - 1);
  const std::uint64_t last = bucket - static_cast<std::size_t>(shift) * kBuckets;
  return 1e-9 * static_cast<double>(((last + 1) << shift) - 1);
}

}  // namespace

void Latencies::add(double seconds, std::int64_t count) {
  constexpr double kLongest = 1e9;
  seconds = std::clamp(seconds, 0.0, kLongest);
  const std::size_t bucket = bucket_of(static_cast<std::uint64_t>(std::llround(seconds * 1e9)));
  if (bucket >= buckets_.size()) buckets_.resize(bucket + 1);
  buckets_[bucket] += count;
  count_ += count;
  largest_ = std::max(largest_, seconds);
}

double Latencies::quantile(double fraction) const {
  const double wanted = fraction * static_cast<double>(count_);
  std::int64_t below = 0;
  for (std::size_t bucket = 0; bucket < buckets_.size(); ++bucket) {
    below += buckets_[bucket];
    if (buckets_[bucket] > 0 && static_cast<double>(below) >= wanted)
      return std::min(end_of(bucket), largest_);
  }
  return largest_;
}

}  // namespace weft::client

#include "core/cloth_contact/steady_motion.h"

#include <algorithm>
#include <limits>
#include <type_traits>
#include <vector>

namespace weft {
namespace {

constexpr Eigen::Index kTogether = 4;  // particles, whose values fill vectors
template <Eigen::Index kParticles>
using Ways = Eigen::Array<double, 3, kParticles>;

// How far columns of way(first, number of them) lie apart, m.
template <class Way>
double spread(ThreadPool& pool, Eigen::Index count, const Way& way) {
  struct Box {
    Ways<1> low = Ways<1>::Constant(std::numeric_limits<double>::infinity());
    Ways<1> high = -low;
  };
  std::vector<Box> boxes(shares_of(pool, count, kParticlesOfShare));
  run_shares(
      pool, boxes.size(), count, [&](std::size_t share, std::int64_t begin, std::int64_t end) {
        // of values that stay in registers
        Ways<kTogether> low = Ways<kTogether>::Constant(std::numeric_limits<double>::infinity()),
                        high = -low;
        Eigen::Index i = begin;
        for (; i + kTogether <= end; i += kTogether) {
          const Ways<kTogether> at = way(i, std::integral_constant<Eigen::Index, kTogether>());
          low = low.min(at);
          high = high.max(at);
        }
        Box box{low.rowwise().minCoeff(), high.rowwise().maxCoeff()};
        for (; i < end; ++i) {
          const Ways<1> at = way(i, std::integral_constant<Eigen::Index, 1>());
          box = {box.low.min(at), box.high.max(at)};
        }
        boxes[share] = box;
      });
  Box all;
  for (const Box& box : boxes) all = {all.low.min(box.low), all.high.max(box.high)};
  return (all.high - all.low).matrix().norm();
}

}  // namespace

void SteadyMotion::begin(const Matrix3Xd& from, const Matrix3Xd& to, int steps, int taken) {
  from_ = from;
  by_ = (to - from) * (1.0 / steps);
  steps_ = steps;
  taken_ = taken;
  differs_ = strays_ = 0;
}

void SteadyMotion::measure(const Matrix3Xd& x, const Matrix3Xd& d, ThreadPool& pool) {
  if (steps_ == 0) return;
  const auto taken = static_cast<double>(taken_);
  const auto beside = [&](Eigen::Index i, auto count) {
    constexpr Eigen::Index n = count();
    return Ways<n>(x.middleCols<n>(i).array() - from_.middleCols<n>(i).array() -
                   taken * by_.middleCols<n>(i).array());
  };
  const auto difference = [&](Eigen::Index i, auto count) {
    constexpr Eigen::Index n = count();
    return Ways<n>(d.middleCols<n>(i).array() - by_.middleCols<n>(i).array());
  };
  strays_ = std::min(strays_, spread(pool, x.cols(), beside));
  differs_ = std::min(differs_, spread(pool, x.cols(), difference));
}

}  // namespace weft

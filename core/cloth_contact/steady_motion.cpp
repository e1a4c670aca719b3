#include "core/cloth_contact/steady_motion.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace weft {
namespace {

// How far way(0), way(1), ... lie apart, m.
template <class Way>
double spread(ThreadPool& pool, Eigen::Index count, const Way& way) {
  struct Box {
    Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity());
    Eigen::Array3d high = -low;
  };
  std::vector<Box> boxes(shares_of(pool, count, kParticlesOfShare));
  run_shares(pool, boxes.size(), count,
             [&](std::size_t share, std::int64_t begin, std::int64_t end) {
               Box box;  // of values that stay in registers
               for (Eigen::Index i = begin; i < end; ++i) {
                 const Eigen::Array3d at = way(i);
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
  const auto beside = [&](Eigen::Index i) -> Eigen::Array3d {
    return x.col(i) - from_.col(i) - taken * by_.col(i);
  };
  const auto difference = [&](Eigen::Index i) -> Eigen::Array3d { return d.col(i) - by_.col(i); };
  strays_ = std::min(strays_, spread(pool, x.cols(), beside));
  differs_ = std::min(differs_, spread(pool, x.cols(), difference));
}

}  // namespace weft

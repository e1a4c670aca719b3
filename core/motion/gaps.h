#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/motion/saved_values.h"
#include "core/motion/thread_pool.h"

namespace weft {

// How far the parts of a sheet are from the nearest skin. A part is looked at again when it, or a
// collider, may have come as far as its gap was wide.
class Gaps {
 public:
  // So many parts in a row are saved as one, lest snapshots grow with them.
  Gaps(std::size_t parts, std::ptrdiff_t together) : gap_(parts), together_(together) {}

  // Every part is to be looked at.
  void forget() {
    std::fill(gap_.begin(), gap_.end(), 0);
    least_ = come_ = 0;
  }

  // After sheet and colliders have come so far, m: calls look(part), which returns the gap that is
  // left, for those that may touch, shared among so many threads.
  template <class F>
  void look(double come, int threads, ThreadPool& pool, const F& look) {
    constexpr double kRounding = 1.001;
    near_.clear();
    come_ += kRounding * come;
    if (come_ < least_) return;
    for (std::size_t part = 0; part < gap_.size(); ++part)
      if ((gap_[part] -= come_) <= 0) near_.push_back(static_cast<int>(part));
    come_ = 0;

    const int count = static_cast<int>(near_.size()), shares = std::clamp(count, 1, threads);
    const auto look_at_share = [&](int share) {
      for (int i = count * share / shares; i < count * (share + 1) / shares; ++i) {
        const int part = near_[static_cast<std::size_t>(i)];
        gap_[static_cast<std::size_t>(part)] = look(part);
      }
    };
    if (shares == 1)
      look_at_share(0);
    else
      pool.run(shares, look_at_share);
    least_ = *std::min_element(gap_.begin(), gap_.end());
  }
  // Those that were, the last time.
  const std::vector<int>& looked_at() const { return near_; }

  std::size_t parts() const { return gap_.size(); }
  void save(SavedValues& saved) const {
    saved.put(come_);
    for (auto first = gap_.begin(); first != gap_.end(); first += together_)
      saved.put(*std::min_element(first, first + together_));
  }
  void load(LoadedValues& loaded) {
    loaded.take(&come_, 1);
    for (auto first = gap_.begin(); first != gap_.end(); first += together_) {
      loaded.take(&*first, 1);
      std::fill(first, first + together_, *first);
    }
    least_ = *std::min_element(gap_.begin(), gap_.end());
  }

 private:
  std::vector<double> gap_;  // of each part, at least, m
  std::ptrdiff_t together_;
  double least_ = 0, come_ = 0;  // of all parts; how far they may have come since, m
  std::vector<int> near_;
};

}  // namespace weft

#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace weft {

// Lists of what each particle has, one after the other.
template <class A>
class Lists {
 public:
  // Calls each(add) twice, with add(i, value).
  template <class F>
  Lists(int particles, const F& each) : first_(static_cast<std::size_t>(particles) + 1) {
    each([&](int i, const A&) { ++first_[static_cast<std::size_t>(i) + 1]; });
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    all_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    each([&](int i, const A& value) { all_[next[static_cast<std::size_t>(i)]++] = value; });
  }
  std::span<const A> at(int i) const {
    const auto k = static_cast<std::size_t>(i);
    return std::span(all_).subspan(first_[k], first_[k + 1] - first_[k]);
  }

 private:
  std::vector<std::size_t> first_;
  std::vector<A> all_;
};

}  // namespace weft

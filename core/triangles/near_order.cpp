#include "core/triangles/near_order.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/triangles/law.h"

namespace weft {
namespace {

// Halves a sheet across its length, again and again: what lies near is then near in memory.
class Halving {
 public:
  explicit Halving(const std::vector<std::vector<int>>& near)
      : near_(near), part_(near.size()), order_(near.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    halve(0, order_.size());
  }
  const std::vector<int>& order() const { return order_; }

 private:
  void halve(std::size_t begin, std::size_t end) {
    constexpr std::size_t kBlock = TriangleLaw<float>::kBlock;
    constexpr std::size_t kPatch = kBlock * TriangleLaw<float>::kPatchBlocks;
    if (end - begin <= kBlock) return;
    // from one end, which is farthest from any particle, to the other
    spread(begin, end);
    std::swap(order_[begin], order_[end - 1]);
    spread(begin, end);
    const std::size_t unit = end - begin > kPatch ? kPatch : kBlock;
    const std::size_t middle = begin + ((end - begin) / 2 + unit - 1) / unit * unit;
    halve(begin, middle);
    halve(middle, end);
  }
  // Orders a part by how many edges lead there from its first particle.
  void spread(std::size_t begin, std::size_t end) {
    const int mine = ++parts_, seen = ++parts_;
    for (std::size_t k = begin; k < end; ++k) part_[static_cast<std::size_t>(order_[k])] = mine;
    found_.clear();
    for (std::size_t k = begin; k < end; ++k) {
      visit(order_[k], mine, seen);
      for (std::size_t at = found_.size() - 1; at < found_.size(); ++at)
        for (const int j : near_[static_cast<std::size_t>(found_[at])]) visit(j, mine, seen);
      if (found_.size() == end - begin) break;
    }
    std::copy(found_.begin(), found_.end(), order_.begin() + static_cast<std::ptrdiff_t>(begin));
  }
  void visit(int i, int mine, int seen) {
    if (part_[static_cast<std::size_t>(i)] != mine) return;
    part_[static_cast<std::size_t>(i)] = seen;
    found_.push_back(i);
  }

  const std::vector<std::vector<int>>& near_;
  std::vector<int> part_, order_, found_;
  int parts_ = 0;
};

}  // namespace

std::vector<int> near_order(const std::vector<std::vector<int>>& neighbours) {
  return Halving(neighbours).order();
}

}  // namespace weft

#include "core/cloth_contact/block_motion.h"

#include <algorithm>
#include <cstddef>
#include <limits>

namespace weft {

BlockMotion::BlockMotion(const NearBlocks& blocks) : blocks_(blocks) {}

void BlockMotion::forget() {
  box_ = {};
  joined_ = {};
  by_ = {};
}

// By what particles moved by.
void BlockMotion::box_ways(ThreadPool& pool) {
  if (box_.empty()) {
    box_.resize(4 * static_cast<std::size_t>(blocks_.blocks()));
    std::vector<NearBlocks::Node> nodes = {blocks_.root()};
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const NearBlocks::Node node = nodes[k];
      if (node.count() == 1) continue;
      joined_.insert(joined_.begin(), node.number);
      nodes.push_back(node.half(0));
      nodes.push_back(node.half(1));
    }
  }
  constexpr int kLeastShare = 128;  // blocks, of a thread
  for_shares(pool, blocks_.blocks(), kLeastShare, [&](std::int64_t begin, std::int64_t end) {
    for (int b = static_cast<int>(begin); b < static_cast<int>(end); ++b) {
      // by values that stay in registers
      Eigen::Array4f low = Eigen::Array4f::Constant(std::numeric_limits<float>::infinity()),
                     high = -low;
      for (const int i : blocks_.particles(b)) {
        const Eigen::Array4f moved = Eigen::Array4f::MapAligned(by_.data() + 4 * std::ptrdiff_t{i});
        low = low.min(moved);
        high = high.max(moved);
      }
      box_[static_cast<std::size_t>(blocks_.number(b))] = {low, high};
    }
  });
  for (const int node : joined_) {
    const Box &one = box_[static_cast<std::size_t>(2 * node)],
              &other = box_[static_cast<std::size_t>(2 * node + 1)];
    box_[static_cast<std::size_t>(node)] = {one.low.min(other.low), one.high.max(other.high)};
  }
}

void BlockMotion::set(const Matrix3Xd& from, const Matrix3Xd& to, ThreadPool& pool) {
  by_.resize(4, to.cols());
  for_shares(pool, to.cols(), kParticlesOfShare, [&](Eigen::Index begin, Eigen::Index end) {
    for (Eigen::Index i = begin; i < end; ++i)
      by_.col(i) << (to.col(i) - from.col(i)).cast<float>(), 0;
  });
  box_ways(pool);
}

}  // namespace weft

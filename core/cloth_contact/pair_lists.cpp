#include "core/cloth_contact/pair_lists.h"

#include <algorithm>
#include <utility>

namespace weft {

PairLists::PairLists(const Cloth& cloth) : cloth_(cloth), blocks_(cloth) {}

void PairLists::forget() {
  before_ = {};
  lists_ = {};
  met_left_ = lasts_ = -1;
}

void PairLists::update(const Matrix3Xd& x, double margin) {
  // lists of flat cloth stay empty: what shares no particle there is 2.8 thicknesses apart
  const double reach = std::max(1.6 * cloth_.thickest, 2 * margin),
               least = std::max(0.6 * reach, margin);
  blocks_.set(x);
  if (before_.cols() > 0) {
    // what a block moves by lies in a box, and what two move in relation to each other in both
    motion_.assign(static_cast<std::size_t>(blocks_.blocks()), {});
    blocks_.for_each_particle([&](std::size_t block, int particle) {
      motion_[block].extend(x.col(particle) - before_.col(particle));
    });
    NearBlocks::Box all;
    for (const NearBlocks::Box& each : motion_) all.extend(each);
    met_left_ -= all.diagonal().norm();
    for (List& list : lists_)
      list.left -= motion_[static_cast<std::size_t>(list.blocks.one)]
                       .merged(motion_[static_cast<std::size_t>(list.blocks.other)])
                       .diagonal()
                       .norm();
  }
  before_ = x;

  constexpr double kBlocksReach = 8;  // as far as that of lists
  if (met_left_ < least) meet(kBlocksReach * reach);
  lasts_ = met_left_;
  for (List& list : lists_) {
    if (list.left < least) remake(x, reach, list);
    lasts_ = std::min(lasts_, list.left);
  }
}

// Keeps the lists of blocks that have met before.
void PairLists::meet(double reach) {
  std::vector<List> old = std::exchange(lists_, {});
  auto known = old.begin();
  for (const BlockPair& blocks : blocks_.meet(cloth_.thickest + reach)) {
    while (known != old.end() && known->blocks < blocks) ++known;
    if (known != old.end() && known->blocks == blocks)
      lists_.push_back(std::move(*known));
    else
      lists_.push_back({blocks});
  }
  met_left_ = reach;
}

void PairLists::remake(const Matrix3Xd& x, double reach, List& list) {
  list.pairs = {};
  list.left = blocks_.distance(list.blocks) - cloth_.thickest;
  if (list.left >= reach) return;
  list.left = reach;
  list.pairs = find_pairs(cloth_, blocks_, list.blocks, x, reach);
}

}  // namespace weft

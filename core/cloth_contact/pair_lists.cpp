#include "core/cloth_contact/pair_lists.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace weft {

PairLists::PairLists(const Cloth& cloth) : cloth_(cloth), blocks_(cloth) {}

void PairLists::forget() {
  before_ = {};
  lists_ = {};
  motion_ = {};
  met_left_ = lasts_ = -1;
}

bool PairLists::update(const Matrix3Xd& x, double margin, double step) {
  // until now, where it is not known better
  const Vector3d half = Vector3d::Constant(std::min(step, kMostMotion * cloth_.thickest) / 2);
  // faster than that they are looked at in every step
  step = std::min(step, cloth_.thickest);
  // some steps pass until they are looked at again; lists of flat cloth stay empty: what shares no
  // particle there is 2.8 thicknesses apart
  const double least = margin + std::max(3 * step, 0.25 * cloth_.thickest),
               reach = std::max(1.6 * cloth_.thickest, 1.5 * least),
               least_pruned = margin + std::max(2 * step, 0.1 * cloth_.thickest),
               pruned_reach = least_pruned + 0.2 * cloth_.thickest;
  blocks_.set(x);
  NearBlocks::Box all(-half, half);
  if (before_.cols() > 0) {
    all = blocks_.box_motion(before_, x, motion_);
    for (List& list : lists_) {
      const double moved = motion(list.blocks);
      list.left -= moved;
      list.pruned_left -= moved;
    }
  } else {
    motion_.assign(static_cast<std::size_t>(blocks_.blocks()), all);
  }
  before_ = x;

  constexpr double kBlocksReach = 8;  // as far as that of lists
  const double most = kMostMotion * cloth_.thickest, moved = std::min(all.diagonal().norm(), most);
  met_left_ -= moved;
  if (!(met_left_ >= least)) meet(kBlocksReach * reach + moved);

  bool changed = false;
  lasts_ = met_left_;
  for (List& list : lists_) {
    // what was near before this motion is near enough now
    if (!(list.left >= least)) {
      const bool had_none = list.near().empty();
      renew(x, least, reach, list);
      changed = changed || !had_none || !list.near().empty();
    }
    if (list.is_pruned && !(list.pruned_left >= least_pruned)) {
      prune(x, pruned_reach + motion(list.blocks), list);
      changed = true;
    }
    lasts_ = std::min(lasts_, list.is_pruned ? list.pruned_left : list.left);
  }
  return changed;
}

// Of two blocks since the last update in relation to each other, m: what each moved by lies in a
// box, and what both moved by in one around these.
double PairLists::motion(const BlockPair& blocks) const {
  const NearBlocks::Box both = motion_[static_cast<std::size_t>(blocks.one)].merged(
      motion_[static_cast<std::size_t>(blocks.other)]);
  const double most = kMostMotion * cloth_.thickest, moved = both.diagonal().norm();
  return moved < most ? moved : most;
}

// Positions of the particles of both blocks, or of the one.
void PairLists::place(const Matrix3Xd& x, const BlockPair& blocks, Matrix3Xd& at) const {
  const std::span<const int> one = blocks_.particles(blocks.one),
                             other = blocks.one == blocks.other ? std::span<const int>()
                                                                : blocks_.particles(blocks.other);
  at.resize(3, static_cast<Eigen::Index>(one.size() + other.size()));
  Eigen::Index n = 0;
  for (const int i : one) at.col(n++) = x.col(i);
  for (const int i : other) at.col(n++) = x.col(i);
}

// By how much distances within both blocks have changed since their list was made, at most, m: by
// no more than what each particle moved by beside a rotation of all lies within.
double PairLists::change(const Matrix3Xd& x, const List& list) {
  place(x, list.blocks, now_);
  const Eigen::Index last = now_.cols() - 1, half = last / 2;
  // any that turns with the cloth
  const auto frame = [&](const Matrix3Xd& at) -> Eigen::Matrix3d {
    constexpr double kOnALine = 1e-3;  // sine
    const Vector3d a = at.col(last) - at.col(0), b = at.col(half) - at.col(0), out = a.cross(b);
    if (!(out.norm() > kOnALine * a.norm() * b.norm())) return Eigen::Matrix3d::Identity();
    Eigen::Matrix3d axes;
    axes.col(0) = a.normalized();
    axes.col(2) = out.normalized();
    axes.col(1) = axes.col(2).cross(axes.col(0));
    return axes;
  };
  const Eigen::Matrix3d turn = frame(now_) * frame(list.made_at).transpose();
  Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity()),
                 high = -low;
  for (Eigen::Index k = 0; k <= last; ++k) {
    const Eigen::Array3d by = (now_.col(k) - turn * list.made_at.col(k)).array();
    low = low.min(by);
    high = high.max(by);
  }
  constexpr double kRounding = 1e-9;  // of a rotation that is none but for rounding
  const double changed = (high - low).matrix().norm() + kRounding;
  return changed < list.reach ? changed : list.reach;
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

void PairLists::renew(const Matrix3Xd& x, double least, double reach, List& list) {
  constexpr std::size_t kWorthPruning = 32;
  constexpr double kWorth = 1.2;  // of what it is to last at least
  const double moved = motion(list.blocks);
  if (list.made_at.cols() > 0) list.left = list.reach - change(x, list);
  if (list.left >= kWorth * least) return;
  list.pairs = list.pruned = {};
  list.is_pruned = false;
  list.made_at.resize(3, 0);
  list.left = blocks_.distance(list.blocks) - cloth_.thickest;
  if (list.left >= kWorth * least + moved) return;
  list.left = list.reach = reach + moved;
  place(x, list.blocks, list.made_at);
  list.pairs = find_pairs(cloth_, blocks_, list.blocks, x, list.reach);
  list.is_pruned = list.pairs.corners.size() + list.pairs.edges.size() >= kWorthPruning;
  list.pruned_left = -1;
}

void PairLists::prune(const Matrix3Xd& x, double reach, List& list) {
  list.pruned_left = std::min(reach, list.left);
  list.pruned.corners.clear();
  list.pruned.edges.clear();
  for (const ClothPair& pair : list.pairs.corners)
    if (near_corner(cloth_, x, pair.first, pair.second, reach)) list.pruned.corners.push_back(pair);
  for (const ClothPair& pair : list.pairs.edges)
    if (near_edges(cloth_, x, pair.first, pair.second, reach)) list.pruned.edges.push_back(pair);
}

}  // namespace weft

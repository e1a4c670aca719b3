#include "core/cloth_contact/pair_lists.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace weft {

PairLists::PairLists(const Cloth& cloth) : cloth_(cloth), blocks_(cloth) {}

void PairLists::forget() {
  before_ = {};
  states_ = {};
  lists_ = {};
  since_ = in_window_ = {};
  near_ = 0;
  met_left_ = lasts_ = -1;
}

void PairLists::update(const Matrix3Xd& from, const Matrix3Xd& now) {
  const NearBlocks::Box all = blocks_.box_motion(from, now, in_window_);
  look(from, all);
}

void PairLists::expect(const Matrix3Xd& from, double come) {
  const Vector3d half = Vector3d::Constant(come / (2 * std::sqrt(3.0)));
  const NearBlocks::Box all(-half, half);
  in_window_.assign(static_cast<std::size_t>(blocks_.blocks()), all);
  look(from, all);
}

void PairLists::look(const Matrix3Xd& x, const NearBlocks::Box& all_in_window) {
  const double thickest = cloth_.thickest, comes = length(all_in_window);
  blocks_.set(x);
  double moved = kMostMotion * thickest;
  if (before_.cols() > 0) {
    moved = length(blocks_.box_motion(before_, x, since_));
    for (State& state : states_) {
      const double by = between(since_, state.blocks);
      state.left -= by;
      state.near_left -= by;
    }
  }
  before_ = x;

  constexpr double kBlocksReach = 5;  // of the thickest cloth
  met_left_ -= moved;
  if (!(met_left_ >= comes)) meet(std::max(kBlocksReach * thickest, 4 * comes));

  lasts_ = met_left_;
  near_ = 0;
  for (std::size_t k = 0; k < states_.size(); ++k) {
    State& state = states_[k];
    // some windows pass until they are looked at again; lists of flat cloth stay empty: what
    // shares no particle there is 2.8 thicknesses apart
    const double came = state.came = between(in_window_, state.blocks);
    if (!(state.left >= came))
      renew(x, came + std::min(2 * came, 0.5 * thickest) + 0.1 * thickest,
            std::max(1.6 * thickest, came + std::min(7 * came, thickest)), state, lists_[k]);
    if (state.has_some && !(state.near_left >= came))
      prune(x, came + std::clamp(3 * came, 0.05 * thickest, 0.5 * thickest), state, lists_[k]);
    lasts_ = std::min(lasts_, state.has_some ? state.near_left : state.left);
    if (state.is_near) ++near_;
  }
}

// What all within a box moved by in relation to each other, m.
double PairLists::length(const NearBlocks::Box& motion) const {
  constexpr double kRounding = 1e-12;  // m, of positions
  const double most = kMostMotion * cloth_.thickest, moved = motion.diagonal().norm() + kRounding;
  return moved < most ? moved : most;
}

// What two blocks moved by in relation to each other, m: what each moved by lies in a box, and what
// both moved by in one around these.
double PairLists::between(const Motion& motion, const BlockPair& blocks) const {
  return length(motion[static_cast<std::size_t>(blocks.one)].merged(
      motion[static_cast<std::size_t>(blocks.other)]));
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
double PairLists::change(const Matrix3Xd& x, const BlockPair& blocks, const List& list) {
  place(x, blocks, now_);
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
  const std::vector<State> old_states = std::exchange(states_, {});
  std::vector<List> old_lists = std::exchange(lists_, {});
  std::size_t known = 0;
  for (const BlockPair& blocks : blocks_.meet(cloth_.thickest + reach)) {
    while (known < old_states.size() && old_states[known].blocks < blocks) ++known;
    const bool is_known = known < old_states.size() && old_states[known].blocks == blocks;
    states_.push_back(is_known ? old_states[known] : State{blocks});
    lists_.push_back(is_known ? std::move(old_lists[known]) : List{});
  }
  met_left_ = reach;
}

void PairLists::renew(const Matrix3Xd& x, double least, double reach, State& state, List& list) {
  if (list.made_at.cols() > 0) state.left = list.reach - change(x, state.blocks, list);
  if (state.left >= least) return;
  list = {};
  state.has_some = state.is_near = false;
  state.near_left = -1;
  state.left = blocks_.distance(state.blocks) - cloth_.thickest;
  if (state.left >= least) return;
  state.left = list.reach = reach;
  place(x, state.blocks, list.made_at);
  list.all = candidates_of(cloth_, find_pairs(cloth_, blocks_, state.blocks, x, reach));
  state.has_some = !list.all.empty();
}

void PairLists::prune(const Matrix3Xd& x, double reach, State& state, List& list) {
  state.near_left = std::min(reach, state.left);
  list.near = nearer(list.all, x, reach);
  state.is_near = !list.near.empty();
}

}  // namespace weft

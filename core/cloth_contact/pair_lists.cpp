#include "core/cloth_contact/pair_lists.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace weft {
namespace {

template <class T>
std::span<T> part_of(std::vector<T>& all, std::int64_t begin, std::int64_t end) {
  return std::span(all).subspan(static_cast<std::size_t>(begin),
                                static_cast<std::size_t>(end - begin));
}

}  // namespace

PairLists::PairLists(const Cloth& cloth)
    : cloth_(cloth), blocks_(cloth), since_(blocks_), in_window_(blocks_) {}

void PairLists::forget() {
  before_ = {};
  before_about_ = {};
  states_ = {};
  lists_ = decltype(lists_)();
  apart_ = reopened_ = {};
  since_.forget();
  in_window_.forget();
  near_ = met_ = 0;
  lasts_ = -1;
}

void PairLists::update(const Matrix3Xd& from, const Matrix3Xd& now, ThreadPool& pool) {
  in_window_.set(from, now, pool);
  look(
      from, [&](int one, int other) { return length(in_window_.between(one, other)); }, 0, pool);
}

void PairLists::expect(const Matrix3Xd& from, double come, ThreadPool& pool) {
  // when it does not hold any more much else will soon not
  look(
      from, [&](int, int) { return length(come); }, 0.5 * cloth_.thickest, pool);
}

// came(one, other): how far two nodes come in relation to each other in the window, m. What holds
// for less than `spare` beyond that is made anew, too, m.
template <class Came>
void PairLists::look(const Matrix3Xd& x, const Came& came, double spare, ThreadPool& pool) {
  constexpr std::int64_t kLeastShare = 1024, kLeastCloser = 8;  // of a thread
  blocks_.set(x, pool);
  std::vector<std::size_t> closer;  // of apart_
  if (before_.cols() > 0) {
    since_.set(before_, x, pool);
    for_shares(pool, std::ssize(states_), kLeastShare, [&](std::int64_t begin, std::int64_t end) {
      for (State& state : part_of(states_, begin, end)) {
        const double by = since_.between(number(state.blocks.one), number(state.blocks.other));
        state.left -= by;
        state.near_left -= by;
      }
    });
    const auto find_closer = [&](std::int64_t begin, std::int64_t end,
                                 std::vector<std::size_t>& found) {
      for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
        auto& [one, other, left] = apart_[k];
        left -= since_.between(one.number, other.number);
        if (!(left >= came(one.number, other.number) + spare)) found.push_back(k);
      }
    };
    closer = find_in_shares<std::size_t>(pool, std::ssize(apart_), kLeastShare, find_closer);
  }
  meet(came, spare, closer);
  before_ = x;
  before_about_ = blocks_.places();

  const auto is_due = [&](const State& state) {
    return !(state.left >= state.came + spare) ||
           (state.has_some && !(state.near_left >= state.came + spare / 2));
  };
  const auto find_due = [&](std::int64_t begin, std::int64_t end, std::vector<std::size_t>& found) {
    for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
      State& state = states_[k];
      state.came = came(number(state.blocks.one), number(state.blocks.other));
      if (is_due(state)) found.push_back(k);
    }
  };
  auto due = find_in_shares<std::size_t>(pool, std::ssize(states_), kLeastShare, find_due);
  const std::size_t shares = shares_of(pool, std::ssize(due), kLeastCloser);
  if (scratch_.size() < shares) scratch_.resize(shares);
  run_shares(pool, shares, std::ssize(due),
             [&](std::size_t share, std::int64_t begin, std::int64_t end) {
               for (const std::size_t k : part_of(due, begin, end))
                 look_closer(x, spare, scratch_[share], states_[k], *lists_[k]);
             });

  lasts_ = kMostMotion * cloth_.thickest;
  near_ = 0;
  for (const State& state : states_) {
    lasts_ = std::min(lasts_, state.has_some ? state.near_left : state.left);
    if (state.is_near) ++near_;
  }
  for (const Apart& apart : apart_) lasts_ = std::min(lasts_, apart.left);
}

// Some windows pass until it is looked at again. Lists of flat cloth stay empty: what shares no
// particle there is 2.8 thicknesses apart.
void PairLists::look_closer(const Matrix3Xd& x, double spare, Scratch& scratch, State& state,
                            List& list) {
  const double thickest = cloth_.thickest, comes = state.came;
  if (!(state.left >= comes + spare))
    renew(x, least_left(comes),
          std::max(1.6 * thickest, comes + std::min(7 * comes, thickest)) + 3 * spare, scratch,
          state, list);
  if (state.has_some && !(state.near_left >= comes + spare / 2))
    prune(x,
          comes + (spare > 0 ? spare / 2 : std::clamp(3 * comes, 0.05 * thickest, 0.5 * thickest)),
          state, list);
}

void PairLists::look(const Places& now, double come, ThreadPool& pool) {
  constexpr std::size_t kShare = 8;  // of all: more are looked at anew together
  since_.set(before_about_, now, pool);
  const double rounding = since_.rounding();
  const std::size_t most = (states_.size() + apart_.size()) / kShare;
  std::size_t closer = 0;
  const auto look_closer = [&] {
    if (closer++ > 0) return closer <= most;
    now_all_ = now.topRows<3>().cast<double>();
    blocks_.set(now_all_, pool);
    return true;
  };
  lasts_ = kMostMotion * cloth_.thickest;
  for (std::size_t k = 0; k < states_.size() && lasts_ >= come; ++k) {
    const State& state = states_[k];
    const double by = since_.between(number(state.blocks.one), number(state.blocks.other));
    double left = (state.has_some ? state.near_left : state.left) - by;
    if (left < come && look_closer())
      left = left_at(now_all_, state, *lists_[k], state.left - by, come + rounding) - rounding;
    lasts_ = std::min(lasts_, left);
  }
  for (std::size_t k = 0; k < apart_.size() && lasts_ >= come; ++k) {
    const auto& [one, other, left_then] = apart_[k];
    double left = left_then - since_.between(one.number, other.number);
    if (left < come && look_closer())
      left = blocks_.distance(one, other, cloth_.thickest + come + rounding) - cloth_.thickest -
             rounding;
    lasts_ = std::min(lasts_, left);
  }
  // what was not looked at may be nearer still
  if (lasts_ < come) lasts_ = 0;
}

// Of a list without any that are near: how far its pairs may come at x until some are, m. `left`:
// at least, of all it has. Looks for no more than `enough`.
double PairLists::left_at(const Matrix3Xd& x, const State& state, const List& list, double left,
                          double enough) {
  if (list.made_at.cols() == 0)
    return blocks_.distance(state.blocks, cloth_.thickest + enough) - cloth_.thickest;
  auto& [search, now, near] = scratch_.front();
  if (left < enough) left = std::max(left, list.reach - change(x, state.blocks, list, now));
  if (state.has_some && left >= enough) nearer(list.all, x, 0, near, left);
  return left;
}

// Has states for all blocks that may be near. closer: of those that were apart, ascending.
template <class Came>
void PairLists::meet(const Came& came, double spare, const std::vector<std::size_t>& closer) {
  constexpr double kApart = 1.5;  // of the thickest cloth, beside what it comes
  constexpr int kMostLooks = 64;  // until others may lie flat together
  const bool all =
      before_.cols() == 0 || apart_.size() + states_.size() > 2 * met_ || ++looks_ == kMostLooks;
  if (all) looks_ = 0;
  std::vector<BlockPair> met;
  const auto is_far = [&](const NearBlocks::Node& one, const NearBlocks::Node& other, double gap) {
    const double comes = came(one.number, other.number);
    double left = gap - cloth_.thickest;
    if (left < comes + kApart * cloth_.thickest) {
      if (one.count() + other.count() == 2) return false;
      left = blocks_.distance_if_flat(one, other) - cloth_.thickest;
      if (left < least_left(comes) + spare) return false;
    }
    apart_.push_back({one, other, left});
    return true;
  };
  const auto near = [&](const BlockPair& blocks) { met.push_back(blocks); };
  if (all) {
    apart_.clear();
    blocks_.share_out(blocks_.root(), blocks_.root(), is_far, near);
  } else {
    reopened_.clear();
    for (auto k = closer.rbegin(); k != closer.rend(); ++k) {
      reopened_.push_back(std::exchange(apart_[*k], apart_.back()));
      apart_.pop_back();
    }
    for (const Apart& apart : reopened_) blocks_.share_out(apart.one, apart.other, is_far, near);
  }
  std::sort(met.begin(), met.end());
  if (all || !met.empty()) add(met, all);
  if (all) met_ = apart_.size() + states_.size();
}

// Of what is looked at anew, where particles come so far in a window, m.
double PairLists::least_left(double come) const {
  return come + std::min(2 * come, 0.5 * cloth_.thickest) + 0.1 * cloth_.thickest;
}

double PairLists::length(double came) const {
  const double most = kMostMotion * cloth_.thickest;
  return came < most ? came : most;
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
double PairLists::change(const Matrix3Xd& x, const BlockPair& blocks, const List& list,
                         Matrix3Xd& now) {
  place(x, blocks, now);
  const Eigen::Index last = now.cols() - 1, half = last / 2;
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
  const Eigen::Matrix3d turn = frame(now) * frame(list.made_at).transpose();
  Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity()),
                 high = -low;
  for (Eigen::Index k = 0; k <= last; ++k) {
    const Eigen::Array3d by = (now.col(k) - turn * list.made_at.col(k)).array();
    low = low.min(by);
    high = high.max(by);
  }
  constexpr double kRounding = 1e-9;  // of a rotation that is none but for rounding
  const double changed = (high - low).matrix().norm() + kRounding;
  return changed < list.reach ? changed : list.reach;
}

// Adds blocks that have met, in their order; of the lists before it keeps all, or only theirs.
void PairLists::add(const std::vector<BlockPair>& met, bool only) {
  const std::vector<State> old_states = std::exchange(states_, {});
  std::vector<std::unique_ptr<List>> old_lists = std::exchange(lists_, {});
  states_.reserve(old_states.size() + met.size());
  lists_.reserve(old_states.size() + met.size());
  std::size_t known = 0;
  const auto keep = [&] {
    states_.push_back(old_states[known]);
    lists_.push_back(std::move(old_lists[known]));
  };
  for (const BlockPair& blocks : met) {
    for (; known < old_states.size() && old_states[known].blocks < blocks; ++known)
      if (!only) keep();
    if (known < old_states.size() && old_states[known].blocks == blocks) {
      keep();
      ++known;
    } else {
      states_.push_back({blocks});
      lists_.push_back(std::make_unique<List>());
    }
  }
  if (only) return;
  for (; known < old_states.size(); ++known) keep();
}

void PairLists::renew(const Matrix3Xd& x, double least, double reach, Scratch& scratch,
                      State& state, List& list) {
  if (list.made_at.cols() > 0) state.left = list.reach - change(x, state.blocks, list, scratch.now);
  if (state.left >= least) return;
  constexpr int kMostBent = 7;
  constexpr double kBeyondJoined = 0.3, kBeyond = 1.4;
  list = {};
  state.has_some = state.is_near = false;
  state.near_left = -1;
  // what is bent stays so for a while
  if (state.bent > 0) {
    --state.bent;
    state.left = blocks_.gap(state.blocks) - cloth_.thickest;
  } else {
    state.left = blocks_.distance(state.blocks, cloth_.thickest + least) - cloth_.thickest;
    state.bent_for = state.left >= least ? 0 : std::min(2 * state.bent_for + 1, kMostBent);
    state.bent = state.bent_for;
  }
  if (state.left >= least) return;
  // what is joined is never farther apart
  list.reach =
      reach + (blocks_.are_joined(state.blocks) ? kBeyondJoined : kBeyond) * cloth_.thickest;
  list.all = candidates_of(
      cloth_, find_pairs(cloth_, blocks_, state.blocks, x, reach, list.reach, scratch.search));
  state.left = list.reach;
  place(x, state.blocks, list.made_at);
  state.has_some = !list.all.empty();
}

void PairLists::prune(const Matrix3Xd& x, double reach, State& state, List& list) {
  state.near_left = state.left;
  nearer(list.all, x, reach, list.near, state.near_left);
  state.is_near = !list.near.empty();
}

}  // namespace weft

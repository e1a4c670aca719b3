#include "core/cloth_contact/pair_lists.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace weft {
namespace {

// Of a gap's rounding: of what places moved by beside a rotation.
constexpr double kOfRounding = 8;

template <class T>
std::span<T> part_of(std::vector<T>& all, std::int64_t begin, std::int64_t end) {
  return std::span(all).subspan(static_cast<std::size_t>(begin),
                                static_cast<std::size_t>(end - begin));
}

// Numbers of three points that are far from each other and from a line.
std::array<Eigen::Index, 3> far_corners(const Places& at) {
  const auto farthest = [&](const auto& squared) {
    Eigen::Index number = 0;
    float most = -1;
    for (Eigen::Index k = 0; k < at.cols(); ++k)
      if (const float far = squared(at.col(k)); far > most) {
        most = far;
        number = k;
      }
    return number;
  };
  const Eigen::Vector4f middle = at.rowwise().mean();
  const Eigen::Index one =
      farthest([&](const Eigen::Vector4f& x) { return (x - middle).squaredNorm(); });
  const Eigen::Vector4f from = at.col(one);
  const Eigen::Index other =
      farthest([&](const Eigen::Vector4f& x) { return (x - from).squaredNorm(); });
  const Eigen::Vector4f along = (at.col(other) - from).normalized();
  const Eigen::Index out = farthest([&](const Eigen::Vector4f& x) {
    const Eigen::Vector4f way = x - from;
    return (way - along.dot(way) * along).squaredNorm();
  });
  return {one, other, out};
}

// Axes that turn with these corners.
Eigen::Matrix3d axes_through(const Places& at, const std::array<Eigen::Index, 3>& corners) {
  Eigen::Matrix<double, 3, 2> ways;
  for (const std::size_t k : {0U, 1U})
    ways.col(static_cast<Eigen::Index>(k)) =
        (at.col(corners[k + 1]) - at.col(corners[0])).head<3>().cast<double>();
  return axes_of(ways);
}

}  // namespace

PairLists::PairLists(const Cloth& cloth)
    : cloth_(cloth), blocks_(cloth), since_(blocks_), in_window_(blocks_) {}

void PairLists::forget() {
  before_ = {};
  states_ = {};
  lists_ = decltype(lists_)();
  apart_ = reopened_ = {};
  bent_at_ = {};
  since_.forget();
  in_window_.forget();
  near_ = met_ = 0;
  lasts_ = -1;
  room_.setConstant(-1);
}

void PairLists::update(const Matrix3Xd& from, const Matrix3Xd& now, ThreadPool& pool) {
  constexpr std::int64_t kLeastShare = 8;  // of a thread
  ++updates_;
  in_window_.set(from, now, pool);
  blocks_.set(from, pool);
  std::vector<std::size_t> closer;  // of apart_
  if (before_.cols() > 0) {
    since_.set(before_, from, pool);
    closer = find_due(
        std::span(apart_),
        [&](const Apart& apart, double comes) { return !(apart.left >= comes + spare(comes)); },
        pool);
  }
  meet(closer);
  auto due = find_due(
      std::span(states_),
      [&](const State& state, double comes) {
        const double more = spare(comes);
        return !(state.left >= comes + more / 2) | !(state.left + state.beyond >= comes + more);
      },
      pool);
  before_ = from;
  const std::size_t shares = shares_of(pool, std::ssize(due), kLeastShare);
  if (scratch_.size() < shares) scratch_.resize(shares);
  run_shares(pool, shares, std::ssize(due),
             [&](std::size_t share, std::int64_t begin, std::int64_t end) {
               for (const std::size_t k : part_of(due, begin, end))
                 look_closer(from, scratch_[share], states_[k], *lists_[k]);
             });

  lasts_ = kMostMotion * cloth_.thickest;
  near_ = 0;
  for (const State& state : states_) {
    lasts_ = std::min(lasts_, state.left);
    near_ += state.is_near ? 1 : 0;
  }
  for (const Apart& apart : apart_) lasts_ = std::min(lasts_, apart.left);
  find_room();
}

// Lowers what is left of entries by what their nodes moved by since the last update, and finds, in
// their order, those that are due where they come so far in the window.
template <class Entry, class IsDue>
std::vector<std::size_t> PairLists::find_due(std::span<Entry> entries, const IsDue& is_due,
                                             ThreadPool& pool) {
  constexpr std::int64_t kLeastShare = 1024, kTogether = 32;
  using Together = Eigen::Array<float, kTogether, 1>;
  const bool moved = before_.cols() > 0;
  const auto find = [&](std::int64_t begin, std::int64_t end, std::vector<std::size_t>& found) {
    for (std::int64_t first = begin; first < end; first += kTogether) {
      const auto some = entries.subspan(static_cast<std::size_t>(first),
                                        static_cast<std::size_t>(std::min(kTogether, end - first)));
      Together since = Together::Zero(), comes = Together::Zero();
      for (Eigen::Index n = 0; const Entry& entry : some) {
        if (moved) since[n] = since_.squared(number(entry.one), number(entry.other));
        comes[n++] = in_window_.squared(number(entry.one), number(entry.other));
      }
      since = since.sqrt();
      comes = comes.sqrt();
      // without branches, which nothing foretells
      std::array<std::size_t, kTogether> due;
      std::size_t count = 0;
      for (Eigen::Index n = 0; Entry & entry : some) {
        if (moved) entry.left -= BlockMotion::rounded(since[n]);
        due[count] = static_cast<std::size_t>(first + n);
        count += is_due(entry, at_most(BlockMotion::rounded(comes[n++]))) ? 1 : 0;
      }
      found.insert(found.end(), due.begin(), due.begin() + static_cast<std::ptrdiff_t>(count));
    }
  };
  return find_in_shares<std::size_t>(pool, std::ssize(entries), kLeastShare, find);
}

void PairLists::find_room() {
  room_.setConstant(near_ > 0 ? -1 : lasts_);
  if (near_ > 0) return;
  const Room times{1, 2, 4, 8, 16};
  const auto include = [&](double left, double comes) {
    const bool may_miss = comes >= kMostMotion * cloth_.thickest;
    room_ = may_miss ? Room::Constant(-1) : Room(room_.min(left - times * comes));
  };
  for (const State& state : states_) include(state.left, came(state.one, state.other));
  for (const Apart& apart : apart_) include(apart.left, came(apart.one.number, apart.other.number));
}

// Concave in `times`.
double PairLists::lasts_beside(double times) const {
  times = std::max(times, 1.0);
  Eigen::Index k = 0;
  for (double from = 1; k + 1 < room_.size(); ++k, from *= 2)
    if (times <= 2 * from) return room_[k] + (times / from - 1) * (room_[k + 1] - room_[k]);
  return -1;
}

// Where nothing is near, what holds for less than that beyond the window, in which it comes so far,
// is made anew, too, m: then all holds for some windows.
double PairLists::spare(double come) const {
  constexpr double kMore = 2, kLeast = 0.25, kMost = 0.8;  // windows; of the thickest cloth
  return near_ > 0 ? 0 : std::min(kMore * come + kLeast * cloth_.thickest, kMost * cloth_.thickest);
}

// Some windows pass until it is looked at again. Lists of flat cloth stay empty: what shares no
// particle there is 2.8 thicknesses apart.
void PairLists::look_closer(const Matrix3Xd& x, Scratch& scratch, State& state, List& list) {
  const double thickest = cloth_.thickest, comes = came(state.one, state.other),
               more = spare(comes);
  double left = state.left + state.beyond;
  if (!(left >= comes + more))
    left = renew(x, left, least_left(comes) + more,
                 std::max(1.6 * thickest, comes + std::min(7 * comes, thickest)) + more, scratch,
                 state, list);
  if (!list.has_some) {
    state.left = left;
  } else if (!(state.left >= comes + more / 2)) {
    state.left = left;
    const double reach =
        more > 0 ? more / 2 : std::clamp(3 * comes, 0.05 * thickest, 0.5 * thickest);
    nearer(list.all, x, comes + reach, list.near, state.left);
    state.is_near = !list.near.empty();
  }
  state.beyond = left - state.left;
}

// Has states for all blocks that may be near. closer: of those that were apart, ascending.
void PairLists::meet(const std::vector<std::size_t>& closer) {
  constexpr double kApart = 1.5;    // of the thickest cloth, beside what it comes
  constexpr int kMostUpdates = 64;  // until others may lie flat together
  const bool all = before_.cols() == 0 || apart_.size() + states_.size() > 2 * met_ ||
                   updates_ - all_met_at_ >= kMostUpdates;
  if (all) all_met_at_ = updates_;
  std::vector<BlockPair> met;
  bent_at_.resize(4 * static_cast<std::size_t>(blocks_.blocks()));
  const auto bent_at = [&](const NearBlocks::Node& node) -> std::int64_t& {
    return bent_at_[static_cast<std::size_t>(node.number)];
  };
  const auto is_far = [&](const NearBlocks::Node& one, const NearBlocks::Node& other, double gap) {
    const double comes = came(one.number, other.number);
    double left = gap - cloth_.thickest;
    if (left < comes + kApart * cloth_.thickest) {
      if (one.count() + other.count() == 2) return false;
      // what is bent hardly lies flat with others
      if (bent_at(one) == updates_ || bent_at(other) == updates_) return false;
      left = blocks_.distance_if_flat(one, other) - cloth_.thickest;
      if (left < least_left(comes) + spare(comes)) {
        if (one.number == other.number) bent_at(one) = updates_;
        return false;
      }
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

// Places of the particles of both blocks, or of the one.
void PairLists::place(const BlockPair& blocks, Places& at) const {
  const std::span<const int> one = blocks_.particles(blocks.one),
                             other = blocks.one == blocks.other ? std::span<const int>()
                                                                : blocks_.particles(blocks.other);
  at.resize(4, static_cast<Eigen::Index>(one.size() + other.size()));
  Eigen::Index n = 0;
  for (const int i : one) at.col(n++) = blocks_.place(i);
  for (const int i : other) at.col(n++) = blocks_.place(i);
}

// By how much distances within both blocks have changed since their list was made, at most, m: by
// no more than what each particle moved by beside a rotation of all lies within.
double PairLists::change(const BlockPair& blocks, const List& list, Places& now) const {
  place(blocks, now);
  Eigen::Matrix4f turn = Eigen::Matrix4f::Zero();
  turn.topLeftCorner<3, 3>() =
      (axes_through(now, list.corners) * list.axes.transpose()).cast<float>();
  Eigen::Array4f low = Eigen::Array4f::Constant(std::numeric_limits<float>::infinity()),
                 high = -low;
  for (Eigen::Index k = 0; k < now.cols(); ++k) {
    const Eigen::Array4f by = (now.col(k) - turn * list.made_at.col(k)).array();
    low = low.min(by);
    high = high.max(by);
  }
  const double changed = double{(high - low).matrix().norm()} + kOfRounding * blocks_.rounding();
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
    lists_.push_back(std::move(old_lists[known++]));
  };
  const auto keep_until = [&](std::size_t end) {
    while (known < end) keep();
  };
  for (const BlockPair& blocks : met) {
    const auto is_before = [](const std::unique_ptr<List>& list, const BlockPair& other) {
      return list->blocks < other;
    };
    const auto from = old_lists.begin() + static_cast<std::ptrdiff_t>(known);
    const auto at = std::lower_bound(from, old_lists.end(), blocks, is_before);
    const auto end = static_cast<std::size_t>(at - old_lists.begin());
    if (!only) keep_until(end);
    known = end;
    if (known < old_lists.size() && old_lists[known]->blocks == blocks) {
      keep();
    } else {
      states_.push_back({blocks_.number(blocks.one), blocks_.number(blocks.other)});
      lists_.push_back(std::make_unique<List>(List{.blocks = blocks}));
    }
  }
  if (!only) keep_until(old_lists.size());
}

// How long it holds then, m; left: how long it does.
double PairLists::renew(const Matrix3Xd& x, double left, double least, double reach,
                        Scratch& scratch, State& state, List& list) {
  if (list.reach > 0) left = std::max(left, list.reach - change(list.blocks, list, scratch.now));
  if (left >= least) return left;
  constexpr int kMostBent = 7;
  constexpr double kBeyondJoined = 0.3, kBeyond = 1.4;
  list.reach = 0;
  list.has_some = state.is_near = false;
  state.left = -1;
  // what is bent stays so for a while
  if (list.bent > 0) {
    --list.bent;
    left = blocks_.gap(list.blocks) - cloth_.thickest;
  } else {
    left = blocks_.distance(list.blocks, cloth_.thickest + least) - cloth_.thickest;
    list.bent_for = left >= least ? 0 : std::min(2 * list.bent_for + 1, kMostBent);
    list.bent = list.bent_for;
  }
  if (left >= least) return left;
  // what is joined is never farther apart
  list.reach =
      reach + (blocks_.are_joined(list.blocks) ? kBeyondJoined : kBeyond) * cloth_.thickest;
  list.all = candidates_of(
      cloth_, find_pairs(cloth_, blocks_, list.blocks, x, reach, list.reach, scratch.search));
  list.reach -= kOfRounding * blocks_.rounding();
  place(list.blocks, list.made_at);
  if (list.corners[0] == list.corners[1]) list.corners = far_corners(list.made_at);
  list.axes = axes_through(list.made_at, list.corners);
  list.has_some = !list.all.empty();
  return list.reach;
}

}  // namespace weft

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/cloth_contact/block_motion.h"
#include "core/cloth_contact/near_blocks.h"
#include "core/cloth_contact/pairs.h"

namespace weft {

// The pairs that may have met in a window of steps, kept in lists (Verlet 1967), one for each two
// blocks that may be near each other. A list has what was nearer than its thickness and some reach
// when it was made, and of that what was nearer still when it was pruned (Pall & Hess 2013); it
// holds until these two blocks have moved as far in relation to each other, however far they came
// together.
class PairLists {
 public:
  explicit PairLists(const Cloth& cloth);

  void forget();
  // For others to ask, between updates.
  NearBlocks& blocks() { return blocks_; }
  // Cloth was at `from` when a window began, and came to where it is now, (3 x particles) m. Has
  // the lists hold every pair that was nearer than its thickness and what its blocks have come
  // since, or kMostMotion.
  void update(const Matrix3Xd& from, const Matrix3Xd& now, ThreadPool& pool);
  // How far particles may come in relation to each other, from the last `from` on, until lists do
  // not hold any more, m; and how far beside the motion of the last update where that has gone on,
  // so many times in all.
  double lasts() const { return lasts_; }
  double lasts_beside(double times) const;
  // Of the thickest cloth; pairs that came farther in a window, or since the last update, may be
  // missed.
  static constexpr double kMostMotion = 8;

  bool empty() const { return near_ == 0; }
  // Calls f(blocks, candidates, how far they came in relation to each other in the window, m) for
  // every list that has some, in an order that depends on the blocks alone.
  template <class F>
  void for_each_list(const F& f) const {
    for (std::size_t k = 0; k < states_.size(); ++k)
      if (const State& state = states_[k]; state.is_near)
        f(lists_[k]->blocks, lists_[k]->near, came(state.one, state.other));
  }

 private:
  // What is looked at in every window, and what in some.
  struct State {
    int one, other;  // nodes
    bool is_near = false;
    double left = -1;   // of the reach of what is near, m
    double beyond = 0;  // that, of the reach of all, m
  };
  struct List {
    BlockPair blocks;
    bool has_some = false;
    int bent = 0, bent_for = 0;                // how often it is not asked whether they lie flat
    double reach = 0;                          // when it was made, m; 0: it was not
    Places made_at = {};                       // of the particles of both blocks
    std::array<Eigen::Index, 3> corners = {};  // of these, far from each other when first made
    Eigen::Matrix3d axes = {};                 // that turn with these
    Candidates all = {}, near = {};
  };
  // Nodes of blocks that are so far apart, or lie so flat together, that no two of their blocks
  // have a list.
  struct Apart {
    NearBlocks::Node one, other;
    double left;  // until they may be near, m
  };
  // What looking closer uses, of each share of it.
  struct Scratch {
    NearBlocks::Search search;
    Places now;
  };

  double came(int one, int other) const { return at_most(in_window_.between(one, other)); }
  // m; no more than kMostMotion.
  double at_most(double motion) const {
    const double most = kMostMotion * cloth_.thickest;
    return motion < most ? motion : most;
  }
  static int number(int node) { return node; }
  static int number(const NearBlocks::Node& node) { return node.number; }
  template <class Entry, class IsDue>
  std::vector<std::size_t> find_due(std::span<Entry> entries, const IsDue& is_due,
                                    ThreadPool& pool);
  double spare(double come) const;
  void meet(const std::vector<std::size_t>& closer);
  void add(const std::vector<BlockPair>& met, bool only);
  double least_left(double come) const;
  void find_room();
  void place(const BlockPair& blocks, Places& at) const;
  double change(const BlockPair& blocks, const List& list, Places& now) const;
  void look_closer(const Matrix3Xd& x, Scratch& scratch, State& state, List& list);
  double renew(const Matrix3Xd& x, double left, double least, double reach, Scratch& scratch,
               State& state, List& list);

  const Cloth& cloth_;
  NearBlocks blocks_;
  Matrix3Xd before_;   // where the window of the last update began, m; or empty
  double lasts_ = -1;  // m
  using Room = Eigen::Array<double, 5, 1>;
  Room room_ = Room::Constant(-1);  // beside 1, 2, 4, 8 and 16 times the motion, m
  std::int64_t updates_ = 0;
  std::vector<Apart> apart_, reopened_;
  std::int64_t all_met_at_ = 0;               // the update in which all were looked for
  std::size_t met_ = 0;                       // of them and of states then
  std::vector<std::int64_t> bent_at_;         // of each node: the last update in which it was bent
  std::vector<State> states_;                 // in ascending order of blocks
  std::vector<std::unique_ptr<List>> lists_;  // of these
  std::size_t near_ = 0;                      // lists that have some
  BlockMotion since_, in_window_;
  std::vector<Scratch> scratch_ = std::vector<Scratch>(1);
};

}  // namespace weft

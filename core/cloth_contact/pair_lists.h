#pragma once

#include <vector>

#include "core/cloth_contact/near_blocks.h"
#include "core/cloth_contact/pairs.h"

namespace weft {

// The pairs that may act before long, kept in lists (Verlet 1967), one for each two blocks that are
// near each other. A list has what was nearer than its thickness and some reach when it was made,
// and of that what was nearer still when it was pruned (Pall & Hess 2013); it holds until these two
// blocks have moved as far in relation to each other, however far they came together.
class PairLists {
 public:
  explicit PairLists(const Cloth& cloth);

  void forget();
  // For others to ask, between updates.
  NearBlocks& blocks() { return blocks_; }
  // How far particles may move in relation to each other until lists are looked at again, m.
  double lasts() const { return lasts_; }
  // Of the thickest cloth; pairs that came farther since the last update may be missed.
  static constexpr double kMostMotion = 8;
  // Cloth is at x now, (3 x particles) m, and may come as far as `step` (m) in a step in relation
  // to anything else. Has the lists hold every pair that is nearer than its thickness and `margin`
  // (m), or was since the last update, or will be as long as nothing moves farther than lasts()
  // less the margin in relation to anything else. Whether other pairs are near than before.
  bool update(const Matrix3Xd& x, double margin, double step);

  // Calls f(pairs) for every list, in an order that depends on the blocks alone.
  template <class F>
  void for_each_list(const F& f) const {
    for (const List& list : lists_)
      if (!list.near().empty()) f(list.near());
  }

 private:
  struct List {
    BlockPair blocks;
    double left = -1, pruned_left = -1;  // of the reach of each, m
    double reach = 0;                    // when it was made, m
    Matrix3Xd made_at = {};              // of the particles of both blocks, m; or empty
    ClothPairs pairs = {}, pruned = {};
    bool is_pruned = false;

    const ClothPairs& near() const { return is_pruned ? pruned : pairs; }
  };

  void meet(double reach);
  double motion(const BlockPair& blocks) const;
  void place(const Matrix3Xd& x, const BlockPair& blocks, Matrix3Xd& at) const;
  double change(const Matrix3Xd& x, const List& list);
  void renew(const Matrix3Xd& x, double least, double reach, List& list);
  void prune(const Matrix3Xd& x, double reach, List& list);

  const Cloth& cloth_;
  NearBlocks blocks_;
  Matrix3Xd before_;                     // positions at the last update, m; or empty
  double met_left_ = -1;                 // of the reach that blocks were met with, m
  double lasts_ = -1;                    // m
  std::vector<List> lists_;              // in ascending order of blocks
  std::vector<NearBlocks::Box> motion_;  // of each block since then, m
  Matrix3Xd now_;
};

}  // namespace weft

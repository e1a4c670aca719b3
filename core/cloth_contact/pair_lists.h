#pragma once

#include <vector>

#include "core/cloth_contact/near_blocks.h"
#include "core/cloth_contact/pairs.h"

namespace weft {

// The pairs that may act before long, kept in lists (Verlet 1967), one for each two blocks that are
// near each other. A list has what was nearer than its thickness and some reach when it was made;
// it holds until these two blocks have moved as far in relation to each other, however far they
// came together.
class PairLists {
 public:
  explicit PairLists(const Cloth& cloth);

  void forget();
  // How far particles may move in relation to each other until lists are looked at again, m.
  double lasts() const { return lasts_; }
  // Has the lists hold every pair that can be nearer than its thickness and `margin` (m) as long as
  // nothing moves farther than lasts() in relation to anything else. x: (3 x particles) m.
  void update(const Matrix3Xd& x, double margin);

  // Calls f(pairs) for every list, in an order that depends on the blocks alone.
  template <class F>
  void for_each_list(const F& f) const {
    for (const List& list : lists_)
      if (!list.pairs.empty()) f(list.pairs);
  }

 private:
  struct List {
    BlockPair blocks;
    double left = -1;  // of its reach, m
    ClothPairs pairs = {};
  };

  void meet(double reach);
  void remake(const Matrix3Xd& x, double reach, List& list);

  const Cloth& cloth_;
  NearBlocks blocks_;
  Matrix3Xd before_;                     // positions at the last update, m; or empty
  double met_left_ = -1;                 // of the reach that blocks were met with, m
  double lasts_ = -1;                    // m
  std::vector<List> lists_;              // in ascending order of blocks
  std::vector<NearBlocks::Box> motion_;  // of each block since then, m
};

}  // namespace weft

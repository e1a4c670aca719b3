#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/cloth_contact/flat_patches.h"
#include "core/cloth_contact/small_boxes.h"
#include "core/motion/thread_pool.h"

namespace weft {

// Of particles, rounded to single precision, m; fourth components are 0. (4 x particles)
using Places = Eigen::Matrix4Xf;

// Two blocks of a cloth's triangles, one <= other.
struct BlockPair {
  int one = 0, other = 0;
  auto operator<=>(const BlockPair&) const = default;
};

// Finds what is near by boxes around blocks of triangles, and around blocks of blocks.
class NearBlocks {
 public:
  using Box = Eigen::AlignedBox3d;
  // Blocks first ... last - 1; its halves are 2 number and 2 number + 1.
  struct Node {
    int number, first, last;
    int count() const { return last - first; }
    Node half(int which) const {
      const int middle = (first + last) / 2;
      return which == 0 ? Node{2 * number, first, middle} : Node{2 * number + 1, middle, last};
    }
  };

  explicit NearBlocks(const Cloth& cloth);

  int blocks() const { return static_cast<int>(box_.size()); }
  Node root() const { return {1, 0, blocks()}; }
  // Of a block: the node that has it alone.
  int number(int block) const { return number_[static_cast<std::size_t>(block)]; }
  // From now on cloth is at x, (3 x particles) m, which outlives what is asked.
  void set(const Matrix3Xd& x, ThreadPool& pool = calling_thread());
  // Two blocks, or a block and itself, whose boxes are no farther apart than `reach`, m, along any
  // axis; in ascending order.
  std::vector<BlockPair> meet(double reach);
  // Shares out every two blocks of two nodes, or of one and every block with itself: calls
  // is_far(one, other, gap of their boxes, m) for nodes, or for one and itself, and where that is
  // false for their halves; near(blocks) for what is left.
  template <class IsFar, class Near>
  void share_out(const Node& one, const Node& other, const IsFar& is_far, const Near& near) {
    box_node(one);
    if (one.number != other.number) box_node(other);
    one.number == other.number ? share_out_within(one, is_far, near)
                               : share_out_between(one, other, is_far, near);
  }
  // Of the boxes of two blocks, m.
  double gap(const BlockPair& blocks) {
    return std::max(gap(block_box(blocks.one), block_box(blocks.other)), 0.0);
  }
  // The least distance between what shares no particle in two blocks, at least, m; 0 where that
  // takes a closer look. The closest is not looked for where it is `enough`.
  // Threads may ask at the same time.
  double distance(const BlockPair& blocks, double enough = 0);
  // The same of all blocks of two nodes, or of one; 0 where they do not lie flat together, m.
  double distance_if_flat(const Node& one, const Node& other) {
    constexpr int kMost = 64;  // blocks
    if (one.count() + other.count() > kMost) return 0;
    return flat_.distance({one.number, one.first, one.last},
                          {other.number, other.first, other.last});
  }
  // Whether they share a particle.
  bool are_joined(const BlockPair& blocks) const;
  // Of two blocks every two triangles, every two edges, or every particle of the one and triangle
  // of the other, whose boxes are no farther apart than `reach`, m; rounding may add some. Until
  // one of these is called again with the same search. Threads may ask at the same time, each with
  // its own.
  class Search;
  std::span<const ClothPair> near_triangles(const BlockPair& blocks, double reach, Search& search);
  std::span<const ClothPair> near_edges(const BlockPair& blocks, double reach, Search& search);
  std::span<const ClothPair> near_corners(int one, int other, double reach, Search& search);
  // Of a particle.
  Eigen::Array4f place(int particle) const {
    return Eigen::Array4f::MapAligned(about_.data() + 4 * std::ptrdiff_t{particle});
  }
  // Of the gap between two places, m.
  double rounding() const { return rounding_; }
  // Of a block.
  std::span<const int> particles(int block) const {
    const auto b = static_cast<std::size_t>(block);
    return std::span(particles_)
        .subspan(static_cast<std::size_t>(first_particle_[b]),
                 static_cast<std::size_t>(first_particle_[b + 1] - first_particle_[b]));
  }

 private:
  // Along the axis on which they are farthest apart, m.
  static double gap(const Box& one, const Box& other) {
    return (one.min() - other.max()).cwiseMax(other.min() - one.max()).maxCoeff();
  }
  const Box& block_box(int block);
  Box& box(const Node& node) { return nodes_[static_cast<std::size_t>(node.number)]; }
  void box_node(const Node& node);
  template <class IsFar, class Near>
  void share_out_within(const Node& node, const IsFar& is_far, const Near& near) {
    if (node.count() == 1) return near(BlockPair{node.first, node.first});
    if (is_far(node, node, gap(box(node), box(node)))) return;
    share_out_within(node.half(0), is_far, near);
    share_out_within(node.half(1), is_far, near);
    share_out_between(node.half(0), node.half(1), is_far, near);
  }
  template <class IsFar, class Near>
  void share_out_between(const Node& one, const Node& other, const IsFar& is_far,
                         const Near& near) {
    if (is_far(one, other, gap(box(one), box(other)))) return;
    if (one.count() == 1 && other.count() == 1) return near(BlockPair{one.first, other.first});
    const bool halve_one = one.count() >= other.count();
    for (const int which : {0, 1})
      share_out_between(halve_one ? one.half(which) : one, halve_one ? other : other.half(which),
                        is_far, near);
  }
  void number_node(const Node& node);
  std::pair<int, int> of_block(const std::vector<int>& first, int block) const;
  void choose(const SmallBoxes::Parts& parts, int near, double reach, SmallBoxes& chosen);
  void choose_triangles(int block, int near, double reach, SmallBoxes& chosen);
  void choose_edges(int block, int near, double reach, SmallBoxes& chosen);
  void choose_corners(int block, int near, double reach, SmallBoxes& chosen);
  float reach_of_boxes(double reach) const;
  std::span<const ClothPair> meet_chosen(double reach, bool ascending, Search& search) const;

  const Cloth& cloth_;
  FlatPatches flat_;
  std::vector<int> first_particle_, particles_;  // of each block
  std::vector<Box> nodes_, box_;                 // nodes: empty where not known
  std::vector<int> known_nodes_;
  std::int64_t now_ = 0;                     // counts what was set
  std::vector<MadeOnce> is_boxed_;           // each block
  std::vector<int> number_;                  // of each block
  std::vector<FlatPatches::Blocks> around_;  // each: some that may be flat together

  const Matrix3Xd* x_ = nullptr;
  Places about_;         // the same
  double rounding_ = 0;  // of the gap between small boxes, m
};

class NearBlocks::Search {
  friend NearBlocks;
  SmallBoxes chosen_, others_;
  std::vector<ClothPair> met_;
};

}  // namespace weft

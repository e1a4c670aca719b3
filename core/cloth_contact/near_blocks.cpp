#include "core/cloth_contact/near_blocks.h"

#include <algorithm>
#include <limits>

namespace weft {

NearBlocks::NearBlocks(const Cloth& cloth)
    : cloth_(cloth),
      flat_(cloth),
      box_(cloth.first_block.size() - 1),
      triangle_box_(cloth.triangles.size()),
      boxed_(box_.size()) {
  nodes_.resize(4 * box_.size());
  std::vector<int> in_block;
  first_particle_.push_back(0);
  for (std::size_t b = 0; b < box_.size(); ++b) {
    in_block.clear();
    for (int t = cloth.first_block[b]; t < cloth.first_block[b + 1]; ++t)
      for (const int i : cloth.triangles[static_cast<std::size_t>(t)]) in_block.push_back(i);
    std::sort(in_block.begin(), in_block.end());
    in_block.erase(std::unique(in_block.begin(), in_block.end()), in_block.end());
    particles_.insert(particles_.end(), in_block.begin(), in_block.end());
    first_particle_.push_back(static_cast<int>(particles_.size()));
  }
}

void NearBlocks::set(const Matrix3Xd& x) {
  x_ = &x;
  flat_.set(x);
  std::fill(boxed_.begin(), boxed_.end(), false);
  for (Box& box : box_) box.setEmpty();
}

const NearBlocks::Box& NearBlocks::block_box(int block) {
  const auto b = static_cast<std::size_t>(block);
  Box& box = box_[b];
  if (box.isEmpty())
    for (int k = first_particle_[b]; k < first_particle_[b + 1]; ++k)
      box.extend(x_->col(particles_[static_cast<std::size_t>(k)]));
  return box;
}

std::vector<BlockPair> NearBlocks::meet(double reach) {
  reach_ = reach;
  met_.clear();
  const Node root{1, 0, blocks()};
  box_node(root);
  meet_within(root);
  std::sort(met_.begin(), met_.end());
  return met_;
}

void NearBlocks::box_node(const Node& node) {
  if (node.count() == 1) {
    box(node) = block_box(node.first);
    return;
  }
  box_node(node.half(0));
  box_node(node.half(1));
  box(node) = box(node.half(0)).merged(box(node.half(1)));
}

void NearBlocks::meet_within(const Node& node) {
  if (node.count() == 1) {
    met_.push_back({node.first, node.first});
    return;
  }
  meet_within(node.half(0));
  meet_within(node.half(1));
  meet_between(node.half(0), node.half(1));
}

void NearBlocks::meet_between(const Node& one, const Node& other) {
  if (gap(box(one), box(other)) > reach_) return;
  if (one.count() == 1 && other.count() == 1) {
    met_.push_back({one.first, other.first});
    return;
  }
  const bool halve_one = one.count() >= other.count();
  for (const int which : {0, 1})
    meet_between(halve_one ? one.half(which) : one, halve_one ? other : other.half(which));
}

double NearBlocks::distance(const BlockPair& blocks) {
  const auto& [one, other] = blocks;
  const double between = gap(block_box(one), block_box(other));
  return between > 0 ? between : flat_.distance(one, other);
}

NearBlocks::Box NearBlocks::box_motion(const Matrix3Xd& from, const Matrix3Xd& to,
                                       std::vector<Box>& motion) const {
  Box all;
  motion.resize(box_.size());
  for (std::size_t b = 0; b < box_.size(); ++b) {
    // by values that stay in registers
    Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity()),
                   high = -low;
    for (const int i : particles(static_cast<int>(b))) {
      const Eigen::Array3d by = to.col(i).array() - from.col(i).array();
      low = low.min(by);
      high = high.max(by);
    }
    motion[b] = Box(low.matrix(), high.matrix());
    all.extend(motion[b]);
  }
  return all;
}

void NearBlocks::box_triangles(std::size_t block) {
  if (boxed_[block]) return;
  boxed_[block] = true;
  for (int t = cloth_.first_block[block]; t < cloth_.first_block[block + 1]; ++t) {
    Box& box = triangle_box_[static_cast<std::size_t>(t)];
    box.setEmpty();
    for (const int i : cloth_.triangles[static_cast<std::size_t>(t)]) box.extend(x_->col(i));
  }
}

// Those of a block near another one.
void NearBlocks::choose(int block, int near, double reach, std::vector<int>& triangles) {
  const auto b = static_cast<std::size_t>(block);
  box_triangles(b);
  const Box& there = block_box(near);
  triangles.clear();
  for (int t = cloth_.first_block[b]; t < cloth_.first_block[b + 1]; ++t)
    if (gap(triangle_box(t), there) <= reach) triangles.push_back(t);
}

}  // namespace weft

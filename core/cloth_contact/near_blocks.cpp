#include "core/cloth_contact/near_blocks.h"

#include <algorithm>

namespace weft {

NearBlocks::NearBlocks(const Cloth& cloth)
    : cloth_(cloth),
      flat_(cloth),
      box_(cloth.first_block.size() - 1),
      triangle_box_(cloth.triangles.size()),
      boxed_(box_.size()) {
  nodes_.resize(4 * box_.size());
  number_.resize(box_.size());
  number_node(root());
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
  std::vector<BlockPair> met;
  share_out(
      root(), root(), [&](const Node&, const Node&, double gap) { return gap > reach; },
      [&](const BlockPair& blocks) { met.push_back(blocks); });
  std::sort(met.begin(), met.end());
  return met;
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

void NearBlocks::number_node(const Node& node) {
  constexpr int kFlatTogether = 8;
  if (node.count() <= kFlatTogether && around_.size() == static_cast<std::size_t>(node.first))
    around_.resize(static_cast<std::size_t>(node.last), {node.first, node.last});
  if (node.count() == 1) {
    number_[static_cast<std::size_t>(node.first)] = node.number;
    return;
  }
  number_node(node.half(0));
  number_node(node.half(1));
}

double NearBlocks::distance(const BlockPair& blocks, double enough) {
  const auto& [one, other] = blocks;
  const double between = gap(block_box(one), block_box(other));
  if (between > 0) return between;
  const double together = flat_.distance(around_[static_cast<std::size_t>(one)],
                                         around_[static_cast<std::size_t>(other)]);
  return together >= enough
             ? together
             : std::max(together, flat_.distance({one, one + 1}, {other, other + 1}));
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

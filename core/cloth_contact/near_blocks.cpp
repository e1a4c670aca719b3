#include "core/cloth_contact/near_blocks.h"

#include <algorithm>

namespace weft {
namespace {

SmallBox small_box(const Eigen::Array4f& low, const Eigen::Array4f& high) {
  SmallBox box;
  Eigen::Array4f::MapAligned(box.side.data()) = low;
  Eigen::Array4f::MapAligned(box.side.data() + 4) = -high;
  return box;
}

}  // namespace

NearBlocks::NearBlocks(const Cloth& cloth)
    : cloth_(cloth),
      flat_(cloth, 4 * static_cast<int>(cloth.first_block.size() - 1)),
      box_(cloth.first_block.size() - 1),
      is_boxed_(box_.size()) {
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

void NearBlocks::set(const Matrix3Xd& x, ThreadPool& pool) {
  constexpr double kOfTwo = 8 * 0x1p-24;  // places, of their difference and of the reach
  const double farthest = x.size() > 0 ? x.cwiseAbs().maxCoeff() : 0.0;
  x_ = &x;
  about_.resize(4, x.cols());
  for_shares(pool, x.cols(), kParticlesOfShare, [&](Eigen::Index begin, Eigen::Index end) {
    for (Eigen::Index i = begin; i < end; ++i) about_.col(i) << x.col(i).cast<float>(), 0;
  });
  rounding_ = kOfTwo * farthest;
  flat_.set(about_, farthest);
  ++now_;
  for (const int node : known_nodes_) nodes_[static_cast<std::size_t>(node)].setEmpty();
  known_nodes_.clear();
}

const NearBlocks::Box& NearBlocks::block_box(int block) {
  const auto b = static_cast<std::size_t>(block);
  is_boxed_[b].in(now_, [&] {
    Box box;
    for (int k = first_particle_[b]; k < first_particle_[b + 1]; ++k)
      box.extend(x_->col(particles_[static_cast<std::size_t>(k)]));
    box_[b] = box;
  });
  return box_[b];
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
  if (!box(node).isEmpty()) return;
  known_nodes_.push_back(node.number);
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
    around_.resize(static_cast<std::size_t>(node.last), {node.number, node.first, node.last});
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
  return together >= enough ? together
                            : std::max(together, flat_.distance({number(one), one, one + 1},
                                                                {number(other), other, other + 1}));
}

bool NearBlocks::are_joined(const BlockPair& blocks) const {
  const std::span<const int> one = particles(blocks.one), other = particles(blocks.other);
  for (auto i = one.begin(), j = other.begin(); i != one.end() && j != other.end();) {
    if (*i == *j) return true;
    ++(*i < *j ? i : j);
  }
  return false;
}

float NearBlocks::reach_of_boxes(double reach) const {
  return static_cast<float>(std::max(reach + rounding_, 0.0));
}

// Of parts those near a block.
void NearBlocks::choose(const SmallBoxes::Parts& parts, int near, double reach,
                        SmallBoxes& chosen) {
  const Box& box = block_box(near);
  Eigen::Array4f low = Eigen::Array4f::Zero(), high = low;
  low.head<3>() = box.min().array().cast<float>();
  high.head<3>() = box.max().array().cast<float>();
  chosen.choose(parts, about_.data(), small_box(low, high), reach_of_boxes(reach));
}

void NearBlocks::choose_triangles(int block, int near, double reach, SmallBoxes& chosen) {
  const auto b = static_cast<std::size_t>(block);
  const int first = cloth_.first_block[b], last = cloth_.first_block[b + 1];
  choose({cloth_.triangles[static_cast<std::size_t>(first)].data(), 3, last - first, first}, near,
         reach, chosen);
}

void NearBlocks::choose_edges(int block, int near, double reach, SmallBoxes& chosen) {
  const auto [first, last] = of_block(cloth_.first_edge, block);
  if (first == last) return chosen.clear();
  choose({cloth_.edges[static_cast<std::size_t>(first)].data(), 2, last - first, first}, near,
         reach, chosen);
}

void NearBlocks::choose_corners(int block, int near, double reach, SmallBoxes& chosen) {
  const auto [first, last] = of_block(cloth_.first_corner, block);
  if (first == last) return chosen.clear();
  choose({&cloth_.corners[static_cast<std::size_t>(first)], 1, last - first, first}, near, reach,
         chosen);
  for (int& k : chosen.numbers()) k = cloth_.corners[static_cast<std::size_t>(k)];
}

// Where a list of edges or particles has those of a block: from, to.
std::pair<int, int> NearBlocks::of_block(const std::vector<int>& first, int block) const {
  const auto b = static_cast<std::size_t>(block);
  const auto begin = static_cast<std::size_t>(cloth_.first_block[b]),
             end = static_cast<std::size_t>(cloth_.first_block[b + 1]);
  return {first[begin], first[end]};
}

// Of those chosen and others all that are near each other.
std::span<const ClothPair> NearBlocks::meet_chosen(double reach, bool ascending,
                                                   Search& search) const {
  return search.chosen_.meet(search.others_, ascending, reach_of_boxes(reach), search.met_);
}

std::span<const ClothPair> NearBlocks::near_triangles(const BlockPair& blocks, double reach,
                                                      Search& search) {
  choose_triangles(blocks.one, blocks.other, reach, search.chosen_);
  choose_triangles(blocks.other, blocks.one, reach, search.others_);
  return meet_chosen(reach, blocks.one == blocks.other, search);
}

std::span<const ClothPair> NearBlocks::near_edges(const BlockPair& blocks, double reach,
                                                  Search& search) {
  choose_edges(blocks.one, blocks.other, reach, search.chosen_);
  choose_edges(blocks.other, blocks.one, reach, search.others_);
  return meet_chosen(reach, blocks.one == blocks.other, search);
}

std::span<const ClothPair> NearBlocks::near_corners(int one, int other, double reach,
                                                    Search& search) {
  choose_corners(one, other, reach, search.chosen_);
  choose_triangles(other, one, reach, search.others_);
  return meet_chosen(reach, false, search);
}

}  // namespace weft

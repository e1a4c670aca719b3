#include "core/contact/pose_grid.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "core/contact/pose_scan.h"
#include "core/contact/winding.h"

namespace weft {
namespace {

class PoseGridMaker {
 public:
  PoseGridMaker(const BodyMesh& mesh, const std::vector<Vector3d>& ways, double cell, double reach)
      : mesh_(mesh), ways_(ways), cell_(cell), reach_(reach), band_(reach + std::sqrt(3.0) * cell) {
    lay_out();
    winding_.emplace(mesh_, made_.distances.low, cell, counts_[1] * kCells + 1,
                     counts_[2] * kCells + 1);
  }

  PoseGrid make() {
    find_nearest();
    known_.reserve(scanned_.size() * ScannedBlock::kCorners);
    for (std::size_t i = 0; i < scanned_.size(); ++i) finish(scanned_[i], places_[i]);
    count_steps();
    lay_values();
    for_each_block([&](const Block& at) { fill(at); });
    return std::move(made_);
  }

 private:
  static constexpr int kCells = DistanceGrid::kBlock, kEnds = kCells + 1;
  using Block = std::array<int, 3>;   // along each axis
  using Corner = std::array<int, 3>;  // in cells
  // What is known of a corner.
  struct Known {
    float value = 0;  // m
    Eigen::Vector3f way = Eigen::Vector3f::Zero();
  };

  void lay_out() {
    Eigen::AlignedBox3d box;
    for (const auto& triangle : mesh_.triangles)
      for (const int i : triangle) box.extend(vertex(i));
    // beyond it a value of at least `reach` is so between any corners
    const double margin = band_ + 2 * cell_;
    DistanceGrid& grid = made_.distances;
    grid.cell = cell_;
    grid.reach = reach_;
    grid.low = box.min().array() - margin;
    for (std::size_t axis = 0; axis < 3; ++axis)
      counts_[axis] = static_cast<int>(std::ceil(
          (box.sizes()[static_cast<Eigen::Index>(axis)] + 2 * margin) / (cell_ * kCells)));
    grid.blocks = counts_;
  }

  // Of every corner that one may be nearer to than the band.
  void find_nearest() {
    std::vector<ScannedTriangle> triangles;
    triangles.reserve(mesh_.triangles.size());
    begin_.assign(blocks(), -1);
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const auto [i, j, k] = mesh_.triangles[t];
      const Vector3d &a = vertex(i), &b = vertex(j), &c = vertex(k);
      ScannedTriangle& each = triangles.emplace_back();
      each.number = static_cast<std::int32_t>(t);
      each.corner = a;
      each.ab = b - a;
      each.ac = c - a;
      each.middle = (a + b + c) / 3;
      each.reach = band_ + std::sqrt(std::max({(a - each.middle).squaredNorm(),
                                               (b - each.middle).squaredNorm(),
                                               (c - each.middle).squaredNorm()}));
      const Vector3d least = a.cwiseMin(b).cwiseMin(c), most = a.cwiseMax(b).cwiseMax(c);
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const double low = made_.distances.low[axis];
        const auto n = static_cast<std::size_t>(axis);
        each.first[n] = static_cast<int>(std::ceil((least[axis] - band_ - low) / cell_));
        each.last[n] = static_cast<int>(std::floor((most[axis] + band_ - low) / cell_));
      }
      claim_blocks(each);
    }
    scanned_.resize(places_.size());
    for (ScannedBlock& block : scanned_) {
      std::fill_n(block.squared, ScannedBlock::kCorners, std::numeric_limits<float>::infinity());
      std::fill_n(block.triangle, ScannedBlock::kCorners, -1);
    }
    scan(triangles, made_.distances.low, cell_, counts_, begin_, scanned_);
  }

  // But not those that are too far from the triangle's plane.
  void claim_blocks(const ScannedTriangle& t) {
    const double half_diagonal = std::sqrt(0.75) * (kCells - 1) * cell_;
    const Vector3d normal = t.ab.cross(t.ac).stableNormalized();
    Block at;
    for (at[2] = t.first[2] / kCells; at[2] <= t.last[2] / kCells; ++at[2])
      for (at[1] = t.first[1] / kCells; at[1] <= t.last[1] / kCells; ++at[1])
        for (at[0] = t.first[0] / kCells; at[0] <= t.last[0] / kCells; ++at[0]) {
          std::int32_t& begin = begin_[index(at)];
          const Vector3d middle = place(corner(at, {0, 0, 0})).array() + (kCells - 1) * cell_ / 2;
          if (begin >= 0 || std::abs((middle - t.corner).dot(normal)) > band_ + half_diagonal)
            continue;
          begin = static_cast<std::int32_t>(places_.size());
          places_.push_back(at);
        }
  }

  // Signs and ways.
  void finish(const ScannedBlock& block, const Block& at) {
    for (int i = 0; i < ScannedBlock::kCorners; ++i) {
      const bool inside =
          is_inside(corner(at, {i % kCells, i / kCells % kCells, i / kCells / kCells}));
      Known& known = known_.emplace_back();
      const float distance = std::sqrt(block.squared[i]);
      const auto band = static_cast<float>(band_);
      known.value = inside ? -distance : std::min(distance, band);
      if (distance >= band) continue;
      const auto [a, b, c] = mesh_.triangles[static_cast<std::size_t>(block.triangle[i])];
      const double v = double{block.v[i]}, w = double{block.w[i]};
      known.way = ((1 - v - w) * way(a) + v * way(b) + w * way(c)).cast<float>();
    }
  }

  // Whether any point of a block may be within the reach: it has values at all of its corners then.
  bool is_near(const Block& at) const {
    const double enough = reach_ + std::sqrt(0.75) * cell_;
    for (int i = 0; i < 8; ++i) {
      const Corner end{i & 1, i >> 1 & 1, i >> 2};
      const std::int32_t begin = begin_of({at[0] + end[0], at[1] + end[1], at[2] + end[2]});
      if (begin < 0) continue;
      const Known* const known = &known_[static_cast<std::size_t>(begin) * ScannedBlock::kCorners];
      for (int z = 0; z < (end[2] != 0 ? 1 : kCells); ++z)
        for (int y = 0; y < (end[1] != 0 ? 1 : kCells); ++y)
          for (int x = 0; x < (end[0] != 0 ? 1 : kCells); ++x)
            if (std::abs(known[(z * kCells + y) * kCells + x].value) <= enough) return true;
    }
    return false;
  }

  // From each block to the nearest one that is near, diagonals being as long as sides.
  void count_steps() {
    steps_.assign(blocks(), std::numeric_limits<int>::max() / 2);
    for_each_block([&](const Block& at) {
      if (is_near(at)) steps_[index(at)] = 0;
    });
    const auto look = [&](const Block& at, int sign) {
      int& least = steps_[index(at)];
      for (int i = 0; i < 13; ++i) {  // those that come before it in order, or after
        const Block other{at[0] + sign * (i % 3 - 1), at[1] + sign * (i / 3 % 3 - 1),
                          at[2] + sign * (i / 9 - 1)};
        if (is_block(other)) least = std::min(least, steps_[index(other)] + 1);
      }
    };
    for_each_block([&](const Block& at) { look(at, 1); });
    for (std::size_t i = blocks(); i-- > 0;) {
      const auto n = static_cast<int>(i);
      look({n % counts_[0], n / counts_[0] % counts_[1], n / counts_[0] / counts_[1]}, -1);
    }
  }

  // Blocks outside that are as far as each other share their values.
  void lay_values() {
    std::map<int, std::int32_t> far;  // by steps
    std::int32_t next = 0;
    for_each_block([&](const Block& at) {
      const int steps = steps_[index(at)];
      const bool shared = steps > 0 && !is_inside(corner(at, {0, 0, 0}));
      const auto [found, is_new] = far.try_emplace(shared ? steps : 0, next);
      const std::int32_t begin = shared ? found->second : next;
      made_.distances.begin.push_back(steps > 0 ? ~begin : begin);
      if (!shared || is_new) next += steps > 0 ? 8 : kEnds * kEnds * kEnds;
    });
    made_.distances.values.resize(static_cast<std::size_t>(next));
    for (auto& ways : made_.ways) ways.resize(static_cast<std::size_t>(next));
  }

  void fill(const Block& at) {
    const std::int32_t begin = made_.distances.begin[index(at)];
    const auto first = static_cast<std::size_t>(begin < 0 ? ~begin : begin);
    float* const values = &made_.distances.values[first];
    if (begin >= 0)
      fill_near(at, first);
    else if (is_inside(corner(at, {0, 0, 0})))
      fill_deep(at, values);
    else
      std::fill_n(values, 8, static_cast<float>(reach_ + (steps_[index(at)] - 1) * kCells * cell_));
  }

  // By the nearest steps of those around each corner.
  void fill_deep(const Block& at, float* values) const {
    for (int i = 0; i < 8; ++i) {
      int least = steps_[index(at)];
      for (int k = 0; k < 8; ++k) {
        Block other = at;
        for (std::size_t axis = 0; axis < 3; ++axis)
          if (k >> axis & 1) other[axis] += (i >> axis & 1) != 0 ? 1 : -1;
        if (is_block(other)) least = std::min(least, steps_[index(other)]);
      }
      values[i] = static_cast<float>(-band_ - least * kCells * cell_);
    }
  }

  void fill_near(const Block& at, std::size_t first) {
    bool deep = false;
    std::size_t i = first;
    for (int z = 0; z < kEnds; ++z)
      for (int y = 0; y < kEnds; ++y)
        for (int x = 0; x < kEnds; ++x, ++i) {
          const Known known = known_at(corner(at, {x, y, z}));
          deep |= std::isinf(known.value);
          made_.distances.values[i] = known.value;
          for (std::size_t axis = 0; axis < 3; ++axis)
            made_.ways[axis][i] = known.way[static_cast<Eigen::Index>(axis)];
        }
    if (deep) lead_out(&made_.distances.values[first]);
  }

  // Gives values to corners that are deep inside, from those beside them.
  void lead_out(float* values) const {
    constexpr int kAll = kEnds * kEnds * kEnds;
    constexpr std::array kStrides{1, kEnds, kEnds * kEnds};
    const auto step = static_cast<float>(cell_);
    const auto look = [&](int i, int sign) {
      if (values[i] > 0) return;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const int other = i / kStrides[axis] % kEnds + sign;
        if (other < 0 || other >= kEnds) continue;
        const float beside = values[i + sign * kStrides[axis]];
        values[i] = std::max(values[i], std::min(beside, 0.0F) - step);
      }
    };
    for (int pass = 0; pass < 2; ++pass) {
      for (int i = 0; i < kAll; ++i) look(i, -1);
      for (int i = kAll; i-- > 0;) look(i, 1);
    }
  }

  // Deep inside -infinity.
  Known known_at(const Corner& at) const {
    const std::int32_t begin = begin_of({at[0] / kCells, at[1] / kCells, at[2] / kCells});
    if (begin >= 0)
      return known_[static_cast<std::size_t>(begin * ScannedBlock::kCorners +
                                             (at[2] % kCells * kCells + at[1] % kCells) * kCells +
                                             at[0] % kCells)];
    return {is_inside(at) ? -std::numeric_limits<float>::infinity() : static_cast<float>(band_)};
  }

  template <class F>
  void for_each_block(const F& f) const {
    Block at;
    for (at[2] = 0; at[2] < counts_[2]; ++at[2])
      for (at[1] = 0; at[1] < counts_[1]; ++at[1])
        for (at[0] = 0; at[0] < counts_[0]; ++at[0]) f(at);
  }
  bool is_block(const Block& at) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (at[axis] < 0 || at[axis] >= counts_[axis]) return false;
    return true;
  }
  std::size_t blocks() const {
    return static_cast<std::size_t>(counts_[0]) * static_cast<std::size_t>(counts_[1]) *
           static_cast<std::size_t>(counts_[2]);
  }
  std::size_t index(const Block& at) const {
    return static_cast<std::size_t>((at[2] * counts_[1] + at[1]) * counts_[0] + at[0]);
  }
  std::int32_t begin_of(const Block& at) const { return is_block(at) ? begin_[index(at)] : -1; }
  static Corner corner(const Block& block, const Corner& in_block) {
    return {block[0] * kCells + in_block[0], block[1] * kCells + in_block[1],
            block[2] * kCells + in_block[2]};
  }
  Vector3d place(const Corner& at) const {
    return made_.distances.low + cell_ * Vector3d(at[0], at[1], at[2]);
  }
  bool is_inside(const Corner& at) const { return winding_->at(place(at).x(), at[1], at[2]) > 0; }
  const Vector3d& vertex(int i) const { return mesh_.vertices[static_cast<std::size_t>(i)]; }
  const Vector3d& way(int i) const { return ways_[static_cast<std::size_t>(i)]; }

  const BodyMesh& mesh_;
  const std::vector<Vector3d>& ways_;
  const double cell_, reach_, band_;  // m; farther outside than the band no value is exact
  PoseGrid made_;
  std::array<int, 3> counts_{};  // of blocks along each axis
  std::optional<WindingNumbers> winding_;
  std::vector<std::int32_t> begin_;  // of each block in scanned_, or -1
  std::vector<ScannedBlock> scanned_;
  std::vector<Block> places_;  // of scanned_
  std::vector<Known> known_;   // corners of scanned_
  std::vector<int> steps_;
};

}  // namespace

PoseGrid make_pose_grid(const BodyMesh& mesh, const std::vector<Vector3d>& ways, double cell,
                        double reach) {
  return PoseGridMaker(mesh, ways, cell, reach).make();
}

}  // namespace weft

#include "core/contact/body.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/contact/mend.h"
#include "core/contact/triangle_tree.h"
#include "core/contact/winding.h"
#include "core/model/text.h"
#include "core/motion/thread_pool.h"

namespace weft {
namespace {

constexpr int kCells = DistanceGrid::kBlock, kCorners = kCells + 1;
constexpr int kLastCorner = kCorners - 1;
// A surface of so many squares of a cell has a grid of about 6 MB, at most of 60 MB.
constexpr double kChosenSquares = 9e4, kMostSquares = 9e5, kMostBlocks = 2e6;

double surface_of(const BodyMesh& mesh) {
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto at = [&](int i) { return mesh.vertices[static_cast<std::size_t>(i)]; };
    area += (at(b) - at(a)).cross(at(c) - at(a)).norm() / 2;
  }
  return area;
}

Eigen::AlignedBox3d box_of(const BodyMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const auto& triangle : mesh.triangles)
    for (const int i : triangle) box.extend(mesh.vertices[static_cast<std::size_t>(i)]);
  return box;
}

// Blocks near the surface cost memory, those around it a little, and a reach of many cells.
double cell_of(const BodyMesh& mesh, const BodySettings& settings) {
  constexpr double kMostReach = 6;  // cells
  constexpr double kMoving = 1.5;
  const double surface = surface_of(mesh);
  const double chosen = std::sqrt(surface / kChosenSquares) * (settings.moves ? kMoving : 1);
  const double wanted = settings.cell > 0 ? settings.cell : chosen;
  return std::max({wanted, std::sqrt(surface / kMostSquares), settings.reach / kMostReach,
                   std::cbrt(box_of(mesh).volume() / kMostBlocks) / kCells});
}

// Where a body is faulty: a triangle near each, or -1.
struct Faults {
  int inside_out = -1, overlapping = -1;

  void add(const Faults& later) {
    if (inside_out < 0) inside_out = later.inside_out;
    if (overlapping < 0) overlapping = later.overlapping;
  }
};

// Shares depend on the body alone, and so does what is made of them.
class GridMaker {
 public:
  GridMaker(const BodyMesh& mesh, const TriangleTree& tree, double cell, double reach,
            ThreadPool& pool)
      : mesh_(mesh), tree_(tree), pool_(pool) {
    const auto box = box_of(mesh);
    grid_.cell = cell;
    grid_.reach = reach;
    // beyond it a value of at least `reach` is so between any corners
    const double margin = reach + 2 * cell;
    grid_.low = box.min().array() - margin;
    for (std::size_t axis = 0; axis < 3; ++axis)
      grid_.blocks[axis] = static_cast<int>(
          std::ceil((box.sizes()[static_cast<Eigen::Index>(axis)] + 2 * margin) / (cell * kCells)));
  }

  DistanceGrid make() {
    const auto [columns, rows, layers] = grid_.blocks;
    winding_.emplace(mesh_, grid_.low, grid_.cell, rows * kCells + 1, layers * kCells + 1);
    measure();
    for (int z = 0; z < layers; ++z)
      for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) add_block({x, y, z});
    grid_.values.resize(values_);
    for (const auto& [cells, begin] : far_)
      std::fill_n(grid_.values.begin() + begin, 8,
                  static_cast<float>(grid_.reach + cells * grid_.cell));
    fill_near();
    fill_deep();
    return std::move(grid_);
  }

  const Faults& faults() const { return faults_; }

 private:
  using Corner = std::array<int, 3>;  // in cells from grid_.low, or a block's in blocks

  // Calls f(begin, end, faults) for shares of 0 ... count - 1.
  template <class F>
  void in_shares(std::size_t count, const F& f) {
    constexpr std::size_t kOfShare = 64;
    std::vector<Faults> found(1 + count / kOfShare);
    run_shares(pool_, found.size(), static_cast<std::int64_t>(count),
               [&](std::size_t share, std::int64_t begin, std::int64_t end) {
                 f(static_cast<std::size_t>(begin), static_cast<std::size_t>(end), found[share]);
               });
    for (const Faults& each : found) faults_.add(each);
  }

  // From the middles of blocks to the surface, m: exactly, or at least where all of a cube of them
  // are far.
  void measure() {
    const auto [columns, rows, layers] = grid_.blocks;
    distances_.resize(static_cast<std::size_t>(columns * rows * layers));
    std::vector<Corner> cubes{{0, 0, 0}}, halves;
    const auto most = static_cast<unsigned>(std::max({columns, rows, layers}));
    for (int size = static_cast<int>(std::bit_ceil(most)); size > 0; size /= 2) {
      std::vector<char> near(cubes.size());
      in_shares(cubes.size(), [&](std::size_t begin, std::size_t end, Faults&) {
        int triangle = 0;
        for (std::size_t i = begin; i < end; ++i)
          near[i] = measure(cubes[i], size, triangle) ? 1 : 0;
      });
      halves.clear();
      for (std::size_t i = 0; i < cubes.size(); ++i)
        if (near[i] != 0) halve(cubes[i], size / 2, halves);
      std::swap(cubes, halves);
    }
  }

  // Of a cube of `size` blocks along each axis from the first; false: its parts are to be measured.
  // triangle: one nearby, then the nearest.
  bool measure(const Corner& first, int size, int& triangle) {
    constexpr double kFar = 3;  // times as far as they reach
    const Vector3d middle = middle_of(first, size);
    const double radius = std::sqrt(0.75) * size * kCells * grid_.cell;
    const auto nearest = tree_.nearest(middle, triangle);
    triangle = nearest.triangle;
    const double distance = std::sqrt(nearest.squared);
    if (size == 1) {
      distances_[index(first)] = distance;
      return false;
    }
    if (distance < kFar * radius || distance - radius < std::max(grid_.reach, grid_.cell))
      return true;
    const auto last = [&](std::size_t axis) {
      return std::min(first[axis] + size, grid_.blocks[axis]);
    };
    for (int z = first[2]; z < last(2); ++z)
      for (int y = first[1]; y < last(1); ++y)
        for (int x = first[0]; x < last(0); ++x)
          distances_[index({x, y, z})] = distance - (middle_of({x, y, z}, 1) - middle).norm();
    return false;
  }

  // Adds those of the eight cubes within a larger one that have blocks.
  void halve(const Corner& first, int size, std::vector<Corner>& cubes) const {
    for (int i = 0; i < 8; ++i) {
      const Corner cube{first[0] + (i & 1) * size, first[1] + (i >> 1 & 1) * size,
                        first[2] + (i >> 2) * size};
      bool within = true;
      for (std::size_t axis = 0; axis < 3; ++axis)
        within = within && cube[axis] < grid_.blocks[axis];
      if (within) cubes.push_back(cube);
    }
  }

  // Finds room for its values.
  void add_block(const Corner& block) {
    const double distance = distances_[index(block)];
    const double clear = distance - half_diagonal();  // of every corner, at least
    const bool inside = winding_number(corner(block, {0, 0, 0})) > 0;
    if (!inside && clear >= grid_.reach) return add_far(clear);
    const bool deep = inside && clear >= grid_.cell;
    (deep ? deep_ : near_).push_back(block);
    grid_.begin.push_back(deep ? ~room(8) : room(kCorners * kCorners * kCorners));
  }

  // One for all that are as far, in whole cells.
  void add_far(double clear) {
    const int cells = static_cast<int>((clear - grid_.reach) / grid_.cell);
    const auto [found, is_new] = far_.try_emplace(cells, 0);
    if (is_new) found->second = room(8);
    grid_.begin.push_back(~found->second);
  }

  std::int32_t room(std::size_t values) {
    return static_cast<std::int32_t>(std::exchange(values_, values_ + values));
  }

  void fill_near() {
    in_shares(near_.size(), [&](std::size_t begin, std::size_t end, Faults& faults) {
      TriangleTree::Around around(tree_);
      TriangleTree::Nearest nearest{0, 0};  // of the point before
      for (std::size_t i = begin; i < end; ++i) {
        const Corner& block = near_[i];
        around.set(middle_of(block, 1), half_diagonal(), distances_[index(block)]);
        for_corners(block, [&](const Corner& in_block, float& value, const float* known) {
          if (known != nullptr) return;
          const Corner at = corner(block, in_block);
          nearest = around.nearest(place(at, 0, 1), nearest.triangle);
          value = value_at(at, nearest, faults);
        });
      }
    });
    for (const Corner& block : near_)
      for_corners(block, [&](const Corner&, float& value, const float* known) {
        if (known != nullptr) value = *known;
      });
  }

  // Calls f(in_block, value, known): where the block before has the same value, or nullptr.
  template <class F>
  void for_corners(const Corner& block, const F& f) {
    float* value = grid_.values.data() + grid_.begin[index(block)];
    std::array<const float*, 3> before{};
    for (std::size_t axis = 0; axis < 3; ++axis) before[axis] = values_before(block, axis);
    for (int z = 0; z < kCorners; ++z)
      for (int y = 0; y < kCorners; ++y)
        for (int x = 0; x < kCorners; ++x, ++value) {
          const Corner in_block{x, y, z};
          const float* known = nullptr;
          for (std::size_t axis = 0; axis < 3 && known == nullptr; ++axis) {
            if (in_block[axis] > 0 || before[axis] == nullptr) continue;
            Corner there = in_block;
            there[axis] = kLastCorner;
            known = before[axis] + (there[2] * kCorners + there[1]) * kCorners + there[0];
          }
          f(in_block, *value, known);
        }
  }

  // Of the block before along an axis, where it has all of them; or nullptr.
  const float* values_before(Corner block, std::size_t axis) const {
    if (block[axis] == 0) return nullptr;
    --block[axis];
    const std::int32_t begin = grid_.begin[index(block)];
    return begin < 0 ? nullptr : grid_.values.data() + begin;
  }

  // Corners of up to eight blocks that are deep inside.
  void fill_deep() {
    std::map<Corner, float> values;
    for_deep([&](const Corner& at, float&) { values.try_emplace(at); });
    std::vector<std::pair<const Corner, float>*> all;
    for (auto& each : values) all.push_back(&each);
    in_shares(all.size(), [&](std::size_t begin, std::size_t end, Faults& faults) {
      TriangleTree::Nearest nearest{0, 0};  // of the point before
      for (std::size_t i = begin; i < end; ++i) {
        auto& [at, value] = *all[i];
        nearest = tree_.nearest(place(at, 0, 1), nearest.triangle);
        value = value_at(at, nearest, faults);
      }
    });
    for_deep([&](const Corner& at, float& value) { value = values.at(at); });
  }

  // Calls f(corner, value) for the eight of each block that is deep inside.
  template <class F>
  void for_deep(const F& f) {
    for (const Corner& block : deep_)
      for (int i = 0; i < 8; ++i)
        f(corner(block, {(i & 1) * kCells, (i >> 1 & 1) * kCells, (i >> 2) * kCells}),
          grid_.values[static_cast<std::size_t>(~grid_.begin[index(block)] + i)]);
  }

  float value_at(const Corner& at, const TriangleTree::Nearest& nearest, Faults& faults) const {
    const int winding = winding_number(at);
    if (winding < 0) faults.add({nearest.triangle, -1});
    if (winding > 1) faults.add({-1, nearest.triangle});
    const double distance = std::sqrt(nearest.squared);
    return static_cast<float>(winding > 0 ? -distance : distance);
  }

  double half_diagonal() const { return std::sqrt(0.75) * kCells * grid_.cell; }
  std::size_t index(const Corner& block) const {
    return static_cast<std::size_t>((block[2] * grid_.blocks[1] + block[1]) * grid_.blocks[0] +
                                    block[0]);
  }
  Corner corner(const Corner& block, const Corner& in_block) const {
    return {block[0] * kCells + in_block[0], block[1] * kCells + in_block[1],
            block[2] * kCells + in_block[2]};
  }
  // `in_block` cells along each axis from the first corner of a block.
  Vector3d place(const Corner& block, double in_block, int cells = kCells) const {
    return grid_.low + grid_.cell * (Vector3d(block[0], block[1], block[2]) * cells +
                                     Vector3d::Constant(in_block));
  }
  Vector3d middle_of(const Corner& block, int size) const {
    return place(block, size * kCells / 2.0);
  }
  int winding_number(const Corner& at) const {
    return winding_->at(grid_.low.x() + at[0] * grid_.cell, at[1], at[2]);
  }

  const BodyMesh& mesh_;
  const TriangleTree& tree_;
  ThreadPool& pool_;
  std::optional<WindingNumbers> winding_;
  DistanceGrid grid_;
  std::size_t values_ = 0;           // that there is to be room for
  std::vector<double> distances_;    // see measure()
  std::vector<Corner> near_, deep_;  // blocks
  std::map<int, std::int32_t> far_;  // values of blocks outside, by cells beyond the reach
  Faults faults_;
};

// From the middle of each triangle straight through.
void measure_thickness(Body& body, const TriangleTree& tree, ThreadPool& pool) {
  constexpr std::int64_t kOfShare = 512;
  struct Thinnest {
    double thickness = std::numeric_limits<double>::infinity();
    int triangle = -1;
  };
  const auto count = std::ssize(body.mesh.triangles);
  body.thickness = std::numeric_limits<double>::infinity();
  std::vector<Thinnest> found(static_cast<std::size_t>(1 + count / kOfShare));
  run_shares(pool, found.size(), count,
             [&](std::size_t share, std::int64_t begin, std::int64_t end) {
               for (auto t = begin; t < end; ++t) {
                 const auto at = [&](std::size_t k) -> const Vector3d& {
                   const auto& corners = body.mesh.triangles[static_cast<std::size_t>(t)];
                   return body.mesh.vertices[static_cast<std::size_t>(corners[k])];
                 };
                 const Vector3d inward = (at(2) - at(0)).cross(at(1) - at(0)).stableNormalized();
                 const Vector3d middle = (at(0) + at(1) + at(2)) / 3;
                 const auto triangle = static_cast<int>(t);
                 const double through = tree.first_hit(triangle, middle, inward);
                 if (through < found[share].thickness) found[share] = {through, triangle};
               }
             });
  for (const Thinnest& each : found)
    if (each.thickness < body.thickness) {
      body.thickness = each.thickness;
      body.thinnest = each.triangle;
    }
}

}  // namespace

MadeBody make_body(BodyMesh mesh, const BodySettings& settings, const std::string& field,
                   ThreadPool& pool) {
  MendedMesh mended = mend(std::move(mesh), field);
  if (!mended.problems.empty()) return {nullptr, std::move(mended.problems)};
  auto body = std::make_shared<Body>();
  body->mesh = std::move(mended.mesh);
  body->notes = std::move(mended.notes);
  const TriangleTree tree(body->mesh);
  GridMaker maker(body->mesh, tree, cell_of(body->mesh, settings), settings.reach, pool);
  body->grid = maker.make();
  const auto source = [&](int triangle) {
    return mended.source[static_cast<std::size_t>(triangle)];
  };
  const auto& [inside_out, overlapping] = maker.faults();
  if (inside_out >= 0)
    return {nullptr,
            {{field + ".triangles", join("near triangle ", source(inside_out),
                                         " the surface cuts itself so that a part of it is inside "
                                         "out")}}};
  if (overlapping >= 0)
    body->notes.push_back(join("near triangle ", source(overlapping),
                               " the surface cuts itself: where it overlaps is inside"));
  measure_thickness(*body, tree, pool);
  body->thinnest = source(body->thinnest);
  return {std::move(body), {}};
}

}  // namespace weft

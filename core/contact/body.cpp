#include "core/contact/body.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "core/contact/mend.h"
#include "core/contact/triangle_tree.h"
#include "core/contact/winding.h"
#include "core/model/text.h"

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

class GridMaker {
 public:
  GridMaker(const BodyMesh& mesh, double cell, double reach)
      : mesh_(mesh), tree_(mesh), around_(tree_) {
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
    distances_.resize(static_cast<std::size_t>(columns * rows * layers));
    const auto most = static_cast<unsigned>(std::max({columns, rows, layers}));
    measure({0, 0, 0}, static_cast<int>(std::bit_ceil(most)));
    for (int z = 0; z < layers; ++z)
      for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) add_block({x, y, z});
    grid_.values.shrink_to_fit();
    return std::move(grid_);
  }

  // A triangle where the surface is inside out, or -1.
  int inside_out() const { return inside_out_; }
  // A triangle inside the body, or -1.
  int overlapping() const { return overlapping_; }

 private:
  using Corner = std::array<int, 3>;  // in cells from grid_.low

  // From the middles of blocks to the surface, m, of `size` blocks along each axis from the first:
  // exactly, or at least where all are far.
  void measure(const Corner& first, int size) {
    constexpr double kFar = 3;  // times as far as they reach
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (first[axis] >= grid_.blocks[axis]) return;
    const Vector3d middle = middle_of(first, size);
    const double radius = std::sqrt(0.75) * size * kCells * grid_.cell;
    nearest_ = tree_.nearest(middle, nearest_.triangle);
    const double distance = std::sqrt(nearest_.squared);
    if (size == 1) {
      distances_[index(first)] = distance;
      return;
    }
    if (distance < kFar * radius || distance - radius < std::max(grid_.reach, grid_.cell)) {
      for (int i = 0; i < 8; ++i)
        measure({first[0] + (i & 1) * size / 2, first[1] + (i >> 1 & 1) * size / 2,
                 first[2] + (i >> 2) * size / 2},
                size / 2);
      return;
    }
    const auto last = [&](std::size_t axis) {
      return std::min(first[axis] + size, grid_.blocks[axis]);
    };
    for (int z = first[2]; z < last(2); ++z)
      for (int y = first[1]; y < last(1); ++y)
        for (int x = first[0]; x < last(0); ++x)
          distances_[index({x, y, z})] = distance - (middle_of({x, y, z}, 1) - middle).norm();
  }

  void add_block(const Corner& block) {
    const double cell = grid_.cell, half_diagonal = std::sqrt(0.75) * kCells * cell;
    const double distance = distances_[index(block)];
    const double clear = distance - half_diagonal;  // of every corner, at least
    const bool inside = winding_number(corner(block, {0, 0, 0})) > 0;
    if (!inside && clear >= grid_.reach) return add_far(clear);
    const bool deep = inside && clear >= cell;
    if (!deep) around_.set(middle_of(block, 1), half_diagonal, distance);
    const auto begin = static_cast<std::int32_t>(grid_.values.size());
    grid_.begin.push_back(deep ? ~begin : begin);
    const int step = deep ? kCells : 1;
    for (int z = 0; z < kCorners; z += step)
      for (int y = 0; y < kCorners; y += step)
        for (int x = 0; x < kCorners; x += step)
          grid_.values.push_back(deep ? value_deep(block, {x, y, z}) : value(block, {x, y, z}));
  }

  // One for all that are as far, in whole cells.
  void add_far(double clear) {
    const int cells = static_cast<int>((clear - grid_.reach) / grid_.cell);
    const auto [found, is_new] =
        far_.try_emplace(cells, static_cast<std::int32_t>(grid_.values.size()));
    if (is_new)
      grid_.values.insert(grid_.values.end(), 8,
                          static_cast<float>(grid_.reach + cells * grid_.cell));
    grid_.begin.push_back(~found->second);
  }

  // A corner of up to eight blocks that are deep inside.
  float value_deep(const Corner& block, const Corner& in_block) {
    const Corner at = corner(block, in_block);
    const auto [found, is_new] = deep_.try_emplace(at);
    if (is_new) {
      nearest_ = tree_.nearest(place(at, 0, 1), nearest_.triangle);
      found->second = value_at(at);
    }
    return found->second;
  }

  float value(const Corner& block, const Corner& in_block) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (in_block[axis] == 0)
        if (const auto known = value_of_neighbour(block, in_block, axis)) return *known;
    const Corner at = corner(block, in_block);
    nearest_ = around_.nearest(place(at, 0, 1), nearest_.triangle);
    return value_at(at);
  }

  // Whose nearest triangle is known.
  float value_at(const Corner& at) {
    const int winding = winding_number(at);
    if (winding < 0 && inside_out_ < 0) inside_out_ = nearest_.triangle;
    if (winding > 1 && overlapping_ < 0) overlapping_ = nearest_.triangle;
    const double distance = std::sqrt(nearest_.squared);
    return static_cast<float>(winding > 0 ? -distance : distance);
  }

  // That the block before has, where it has all of them.
  std::optional<float> value_of_neighbour(Corner block, Corner in_block, std::size_t axis) const {
    if (block[axis] == 0) return std::nullopt;
    --block[axis];
    in_block[axis] = kLastCorner;
    const std::int32_t begin = grid_.begin[index(block)];
    if (begin < 0) return std::nullopt;
    const int i = (in_block[2] * kCorners + in_block[1]) * kCorners + in_block[0];
    return grid_.values[static_cast<std::size_t>(begin + i)];
  }

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
  TriangleTree tree_;
  TriangleTree::Around around_;  // the block that is being added
  std::optional<WindingNumbers> winding_;
  DistanceGrid grid_;
  std::vector<double> distances_;        // see measure()
  TriangleTree::Nearest nearest_{0, 0};  // of the point before
  std::map<int, std::int32_t> far_;      // values of blocks outside, by cells beyond the reach
  std::map<Corner, float> deep_;         // values at corners of blocks deep inside
  int inside_out_ = -1, overlapping_ = -1;
};

// From the middle of each triangle straight through.
void measure_thickness(Body& body) {
  const TriangleTree tree(body.mesh);
  body.thickness = std::numeric_limits<double>::infinity();
  for (std::size_t t = 0; t < body.mesh.triangles.size(); ++t) {
    const auto at = [&](std::size_t k) -> const Vector3d& {
      return body.mesh.vertices[static_cast<std::size_t>(body.mesh.triangles[t][k])];
    };
    const Vector3d inward = (at(2) - at(0)).cross(at(1) - at(0)).stableNormalized();
    const Vector3d middle = (at(0) + at(1) + at(2)) / 3;
    const double through = tree.first_hit(static_cast<int>(t), middle, inward);
    if (through >= body.thickness) continue;
    body.thickness = through;
    body.thinnest = static_cast<int>(t);
  }
}

}  // namespace

MadeBody make_body(BodyMesh mesh, const BodySettings& settings, const std::string& field) {
  MendedMesh mended = mend(std::move(mesh), field);
  if (!mended.problems.empty()) return {nullptr, std::move(mended.problems)};
  auto body = std::make_shared<Body>();
  body->mesh = std::move(mended.mesh);
  body->notes = std::move(mended.notes);
  GridMaker maker(body->mesh, cell_of(body->mesh, settings), settings.reach);
  body->grid = maker.make();
  const auto source = [&](int triangle) {
    return mended.source[static_cast<std::size_t>(triangle)];
  };
  if (maker.inside_out() >= 0)
    return {nullptr,
            {{field + ".triangles", join("near triangle ", source(maker.inside_out()),
                                         " the surface cuts itself so that a part of it is inside "
                                         "out")}}};
  if (maker.overlapping() >= 0)
    body->notes.push_back(join("near triangle ", source(maker.overlapping()),
                               " the surface cuts itself: where it overlaps is inside"));
  measure_thickness(*body);
  body->thinnest = source(body->thinnest);
  return {std::move(body), {}};
}

}  // namespace weft

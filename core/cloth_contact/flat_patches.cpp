#include "core/cloth_contact/flat_patches.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

namespace weft {
namespace {

double wedge(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// By Andrew's monotone chain.
std::vector<Vector2d> convex_hull(std::vector<Vector2d> points) {
  const auto before = [](const Vector2d& a, const Vector2d& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  };
  std::sort(points.begin(), points.end(), before);
  std::vector<Vector2d> hull;
  for (int turn = 0; turn < 2; ++turn) {
    const std::size_t begin = hull.size();
    for (const Vector2d& point : points) {
      while (hull.size() >= begin + 2 &&
             wedge(hull.back() - hull[hull.size() - 2], point - hull.back()) <= 0)
        hull.pop_back();
      hull.push_back(point);
    }
    hull.pop_back();  // the other turn begins there
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

// Calls f(corner, inward normal of length 1) for the sides of a polygon until it returns false;
// whether it never did.
template <class F>
bool all_sides(const std::vector<Vector2d>& polygon, const F& f) {
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vector2d side = polygon[(k + 1) % polygon.size()] - polygon[k];
    if (!f(polygon[k], Vector2d(Vector2d(-side.y(), side.x()).normalized()))) return false;
  }
  return true;
}

// Whether a part of the way from `from` to `to` lies deeper inside than `depth`, m.
bool passes_inside(const std::vector<Vector2d>& polygon, const Vector2d& from, const Vector2d& to,
                   double depth) {
  double begin = 0, end = 1;
  return all_sides(polygon, [&](const Vector2d& corner, const Vector2d& normal) {
    const double at = normal.dot(from - corner) - depth, rise = normal.dot(to - from);
    if (rise > 0)
      begin = std::max(begin, -at / rise);
    else if (rise < 0)
      end = std::min(end, at / -rise);
    else if (at <= 0)
      return false;
    return begin < end;
  });
}

// Whether no side of `one` has all of the other beyond it.
bool may_meet(const std::vector<Vector2d>& one, const std::vector<Vector2d>& other) {
  return all_sides(one, [&](const Vector2d& corner, const Vector2d& normal) {
    return std::any_of(other.begin(), other.end(),
                       [&](const Vector2d& point) { return normal.dot(point - corner) >= 0; });
  });
}

}  // namespace

Eigen::Matrix3d axes_of(const Eigen::Matrix<double, 3, 2>& ways) {
  constexpr double kOnALine = 1e-3;  // sine
  const Vector3d normal = ways.col(0).cross(ways.col(1));
  const double sides = ways.col(0).squaredNorm() * ways.col(1).squaredNorm();
  if (!(normal.squaredNorm() > kOnALine * kOnALine * sides)) return Eigen::Matrix3d::Identity();
  Eigen::Matrix3d axes;
  axes.col(0) = ways.col(0).normalized();
  axes.col(2) = normal.normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

FlatPatches::FlatPatches(const Cloth& cloth, int runs)
    : cloth_(cloth), patches_(static_cast<std::size_t>(runs)), gradients_(cloth) {
  const std::size_t blocks = cloth.first_block.size() - 1;
  std::vector<Vector2d> corners;
  // by piece, particles and place: how often
  std::map<std::tuple<int, int, int, double, double>, std::pair<int, Border>> sides;
  for (std::size_t b = 0; b < blocks; ++b) {
    corners.clear();
    double least = std::numeric_limits<double>::infinity();
    for (int t = cloth.first_block[b]; t < cloth.first_block[b + 1]; ++t) {
      const auto at = static_cast<std::size_t>(t);
      const auto& flat = cloth.flat[at];
      Eigen::Matrix2d edges;
      edges << flat[1] - flat[0], flat[2] - flat[0];
      const double longest =
          std::max({edges.col(0).norm(), edges.col(1).norm(), (flat[2] - flat[1]).norm()});
      least = std::min(least, std::abs(edges.determinant()) / longest);
      corners.insert(corners.end(), flat.begin(), flat.end());
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t next = (k + 1) % 3;
        const auto [low, high] = std::minmax(cloth.triangles[at][k], cloth.triangles[at][next]);
        const Vector2d middle = flat[k] + flat[next];
        ++sides
              .try_emplace({cloth.piece[b], low, high, middle.x(), middle.y()}, 0,
                           Border{cloth.piece[b], flat[k], flat[next]})
              .first->second.first;
      }
    }
    hull_.push_back(convex_hull(corners));
    Box& box = box_.emplace_back();
    for (const Vector2d& corner : corners) box.extend(corner);
    least_height_.push_back(least);
  }
  for (const auto& [ends, side] : sides)
    if (side.first != 2) borders_.push_back(side.second);
  are_set_ = std::vector<MadeOnce>(blocks);
}

void FlatPatches::set(const Eigen::Matrix4Xf& places, double farthest) {
  places_ = &places;
  farthest_ = farthest;
  ++now_;
}

double FlatPatches::distance(const Blocks& some, const Blocks& others) {
  const auto piece = [&](int block) { return cloth_.piece[static_cast<std::size_t>(block)]; };
  const auto [first, last] = std::minmax(
      {piece(some.first), piece(some.last - 1), piece(others.first), piece(others.last - 1)});
  if (first != last) return 0;
  Patch& over = patch(some, others);
  if (!over.whole) return 0;
  over.has_distance.in(now_, [&] { over.distance = distance(over); });
  return over.distance;
}

double FlatPatches::distance(const Patch& over) {
  Eigen::Matrix<float, 3, 2> sum = Eigen::Matrix<float, 3, 2>::Zero();
  for (const int block : over.blocks) {
    const auto b = static_cast<std::size_t>(block);
    are_set_[b].in(now_, [&] { gradients_.set(block, *places_); });
    sum += gradients_.sum(block);
  }
  // seen along its mean normal
  const auto [low, high] =
      gradients_.along(axes_of(sum.cast<double>()).leftCols<2>().cast<float>(), over.blocks);
  const Eigen::Matrix2d plane = (low + high).cast<double>().matrix() / 2,
                        square = plane.transpose() * plane;
  const double differs = (high - low).cast<double>().matrix().norm() / 2;
  const double least =
      square.trace() / 2 - std::hypot((square(0, 0) - square(1, 1)) / 2, square(0, 1));
  // of gradients, and of places
  constexpr double kRounding = 32 * 0x1p-24;
  const double most = 1 + double{low.abs().max(high.abs()).maxCoeff()};
  const double rounding = kRounding * (most + farthest_ / over.least_height);
  const double factor = std::sqrt(std::max(least, 0.0)) - differs - rounding;
  return factor > 0 ? factor * over.least_height : 0;
}

FlatPatches::Patch& FlatPatches::patch(const Blocks& some, const Blocks& others) {
  Patch& patch = [&]() -> Patch& {
    const std::lock_guard lock(mutex_);
    auto& known = patches_[static_cast<std::size_t>(some.number)];
    auto at = std::ranges::lower_bound(known, others.number, {}, &Known::other);
    if (at == known.end() || at->other != others.number)
      at = known.insert(at, {others.number, std::make_unique<Patch>()});
    return *at->patch;
  }();
  patch.is_made.in(1, [&] { make(some, others, patch); });
  return patch;
}

// Over these blocks and what lies between them.
void FlatPatches::make(const Blocks& some, const Blocks& others, Patch& patch) const {
  const auto a = static_cast<std::size_t>(some.first);
  const int piece = cloth_.piece[a];
  std::vector<Vector2d> corners;
  Box box;
  for (const Blocks& each : {some, others})
    for (auto b = static_cast<std::size_t>(each.first); b < static_cast<std::size_t>(each.last);
         ++b) {
      corners.insert(corners.end(), hull_[b].begin(), hull_[b].end());
      box.extend(box_[b]);
    }
  const Polygon hull = convex_hull(std::move(corners));
  const double depth = 1e-9 * least_height_[a];
  patch.whole = std::none_of(borders_.begin(), borders_.end(), [&](const Border& border) {
    return border.piece == piece &&
           box.intersects(Box(border.from.cwiseMin(border.to), border.from.cwiseMax(border.to))) &&
           passes_inside(hull, border.from, border.to, depth);
  });
  if (!patch.whole) return;
  patch.least_height = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < hull_.size(); ++c) {
    if (cloth_.piece[c] != piece || !box.intersects(box_[c]) || !may_meet(hull, hull_[c]) ||
        !may_meet(hull_[c], hull))
      continue;
    patch.blocks.push_back(static_cast<int>(c));
    patch.least_height = std::min(patch.least_height, least_height_[c]);
  }
}

}  // namespace weft

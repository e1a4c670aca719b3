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
    : cloth_(cloth), patches_(static_cast<std::size_t>(runs)) {
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
      const Eigen::Matrix2f inverse = edges.inverse().cast<float>();
      const auto row = [&](Eigen::Index k) -> Eigen::Array4f {
        return {inverse(k, 0), inverse(k, 0), inverse(k, 1), inverse(k, 1)};
      };
      inverse_.push_back({row(0), row(1)});
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
  gradients_.resize(blocks);
  are_made_ = std::vector<MadeOnce>(blocks);
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
  Gradient sum = Gradient::Zero();
  for (const int block : over.blocks) sum += gradients(block).sum;
  // seen along its mean normal
  const Gradient seen = axes_of(sum).leftCols<2>();
  Rows ways;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    const auto a = static_cast<float>(seen(axis, 0)), b = static_cast<float>(seen(axis, 1));
    ways[k] = {a, b, a, b};
  }
  Eigen::Array4f low = Eigen::Array4f::Constant(std::numeric_limits<float>::infinity()),
                 high = -low;
  constexpr std::size_t kFew = 8;  // blocks, of which each triangle is looked at
  for (const int block : over.blocks) {
    const Gradients& own = gradients(block);
    if (over.blocks.size() <= kFew) {
      for (const Rows& each : own.each) {
        const Eigen::Array4f plane = ways[0] * each[0] + ways[1] * each[1] + ways[2] * each[2];
        low = low.min(plane);
        high = high.max(plane);
      }
      continue;
    }
    const Gradient along = own.axes.transpose() * seen;
    const Eigen::Matrix2d middle = along.transpose() * own.middle,
                          half = along.cwiseAbs().transpose() * own.half;
    low = low.min((middle - half).reshaped().array().cast<float>());
    high = high.max((middle + half).reshaped().array().cast<float>());
  }
  const Eigen::Array4d middle = (low + high).cast<double>() / 2;
  const double differs = (high - low).cast<double>().matrix().norm() / 2;
  Eigen::Matrix2d plane;
  plane << middle[0], middle[2], middle[1], middle[3];
  const Eigen::Matrix2d square = plane.transpose() * plane;
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

const FlatPatches::Gradients& FlatPatches::gradients(int block) {
  const auto b = static_cast<std::size_t>(block);
  are_made_[b].in(now_, [&] { make(block, gradients_[b]); });
  return gradients_[b];
}

void FlatPatches::make(int block, Gradients& gradients) const {
  const auto b = static_cast<std::size_t>(block);
  gradients.each.clear();
  const float* places = places_->data();
  const auto place = [&](int i) -> Eigen::Array4f {
    return Eigen::Array4f::MapAligned(places + 4 * std::ptrdiff_t{i});
  };
  Rows sum;
  sum.fill(Eigen::Array4f::Zero());
  for (int t = cloth_.first_block[b]; t < cloth_.first_block[b + 1]; ++t) {
    const auto at = static_cast<std::size_t>(t);
    const auto& [i, j, k] = cloth_.triangles[at];
    const Eigen::Array4f from = place(i), one = place(j) - from, other = place(k) - from;
    Rows& rows = gradients.each.emplace_back();
    for (std::size_t row = 0; row < 3; ++row) {
      const auto axis = static_cast<Eigen::Index>(row);
      rows[row] = one[axis] * inverse_[at][0] + other[axis] * inverse_[at][1];
      sum[row] += rows[row];
    }
  }
  for (std::size_t row = 0; row < 3; ++row) {
    const auto axis = static_cast<Eigen::Index>(row);
    gradients.sum(axis, 0) = double{sum[row][0]};
    gradients.sum(axis, 1) = double{sum[row][2]};
  }
  gradients.axes = axes_of(gradients.sum);
  // along the first two axes, and the third
  Rows ways, out;
  for (std::size_t row = 0; row < 3; ++row) {
    const Eigen::Array3f along =
        gradients.axes.row(static_cast<Eigen::Index>(row)).transpose().array().cast<float>();
    ways[row] = {along[0], along[1], along[0], along[1]};
    out[row] = Eigen::Array4f::Constant(along[2]);
  }
  Eigen::Array4f low = Eigen::Array4f::Constant(std::numeric_limits<float>::infinity()),
                 high = -low, low_out = low, high_out = high;
  for (const Rows& each : gradients.each) {
    const Eigen::Array4f in = ways[0] * each[0] + ways[1] * each[1] + ways[2] * each[2],
                         beside = out[0] * each[0] + out[1] * each[1] + out[2] * each[2];
    low = low.min(in);
    high = high.max(in);
    low_out = low_out.min(beside);
    high_out = high_out.max(beside);
  }
  const auto gradient = [](const Eigen::Array4f& in, const Eigen::Array4f& beside) {
    Gradient made;
    made << double{in[0]}, double{in[2]}, double{in[1]}, double{in[3]}, double{beside[0]},
        double{beside[2]};
    return made;
  };
  gradients.middle = gradient((low + high) / 2, (low_out + high_out) / 2);
  gradients.half = gradient((high - low) / 2, (high_out - low_out) / 2);
}

}  // namespace weft

#include "core/contact/triangle_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/contact/nearest.h"

namespace weft {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();
constexpr std::size_t kDeepest = 64;  // halving leaves no more levels

// Whether a ray passes through a box nearer than `most`.
bool meets(const Eigen::AlignedBox3d& box, const Vector3d& start, const Vector3d& inverse,
           double most) {
  const Vector3d one = (box.min() - start).cwiseProduct(inverse);
  const Vector3d other = (box.max() - start).cwiseProduct(inverse);
  const double enters = one.cwiseMin(other).maxCoeff(), leaves = one.cwiseMax(other).minCoeff();
  return enters <= std::min(leaves, most) && leaves >= 0;
}

}  // namespace

TriangleTree::TriangleTree(const BodyMesh& mesh) : mesh_(mesh), order_(mesh.triangles.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  std::vector<Vector3d> middles;
  for (const int t : order_) middles.emplace_back((corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3);
  build(0, static_cast<int>(order_.size()), middles);
  for (const int t : order_) discs_.push_back(disc_of(t, middles[static_cast<std::size_t>(t)]));
}

TriangleTree::Disc TriangleTree::disc_of(int triangle, const Vector3d& middle) const {
  const Vector3d &a = corner(triangle, 0), &b = corner(triangle, 1), &c = corner(triangle, 2);
  const double squared = std::max(
      {(a - middle).squaredNorm(), (b - middle).squaredNorm(), (c - middle).squaredNorm()});
  return {middle, (b - a).cross(c - a).stableNormalized(), std::sqrt(squared)};
}

void TriangleTree::build(int first, int last, const std::vector<Vector3d>& middles) {
  constexpr int kLeaf = 8;
  const std::size_t node = nodes_.size();
  nodes_.emplace_back();
  const auto begin = order_.begin() + first, end = order_.begin() + last;
  Eigen::AlignedBox3d box, of_middles;
  for (auto t = begin; t != end; ++t) {
    for (std::size_t k = 0; k < 3; ++k) box.extend(corner(*t, k));
    of_middles.extend(middles[static_cast<std::size_t>(*t)]);
  }
  nodes_[node].box = box;
  if (last - first <= kLeaf) {
    nodes_[node].first = first;
    nodes_[node].count = last - first;
    return;
  }
  Eigen::Index axis = 0;
  of_middles.sizes().maxCoeff(&axis);
  const int middle = first + (last - first) / 2;
  std::nth_element(begin, order_.begin() + middle, end, [&](int a, int b) {
    return middles[static_cast<std::size_t>(a)][axis] < middles[static_cast<std::size_t>(b)][axis];
  });
  build(first, middle, middles);
  nodes_[node].first = static_cast<int>(nodes_.size());
  build(middle, last, middles);
}

// No more than that of anything in the disc, whatever was rounded.
double TriangleTree::least_squared(const Disc& disc, const Vector3d& point) {
  constexpr double kRounding = 1 - 1e-9;
  const Vector3d off = point - disc.middle;
  const double height = off.dot(disc.normal), above = height * height;
  const double across = std::sqrt(std::max(off.squaredNorm() - above, 0.0));
  const double beside = std::max(across - disc.radius, 0.0);
  return (above + beside * beside) * kRounding;
}

double TriangleTree::squared_distance(int triangle, const Vector3d& point) const {
  const Vector3d &a = corner(triangle, 0), &b = corner(triangle, 1), &c = corner(triangle, 2);
  const auto [u, v, w] = nearest_in_triangle(point, a, b, c);
  return (u * a + v * b + w * c - point).squaredNorm();
}

TriangleTree::Nearest TriangleTree::nearest(const Vector3d& point, int guess) const {
  Nearest best{squared_distance(guess, point), guess};
  std::array<std::pair<int, double>, kDeepest> open;
  std::size_t left = 0;
  open[left++] = {0, nodes_[0].box.squaredExteriorDistance(point)};
  while (left > 0) {
    const auto [index, least] = open[--left];
    if (least >= best.squared) continue;
    const Node& node = nodes_[static_cast<std::size_t>(index)];
    for (int i = node.first; i < node.first + node.count; ++i) {
      if (least_squared(discs_[static_cast<std::size_t>(i)], point) >= best.squared) continue;
      const int t = order_[static_cast<std::size_t>(i)];
      if (const double squared = squared_distance(t, point); squared < best.squared)
        best = {squared, t};
    }
    if (node.count > 0) continue;
    std::pair near(index + 1,
                   nodes_[static_cast<std::size_t>(index) + 1].box.squaredExteriorDistance(point));
    std::pair far(node.first,
                  nodes_[static_cast<std::size_t>(node.first)].box.squaredExteriorDistance(point));
    if (far.second < near.second) std::swap(near, far);
    open[left++] = far;
    open[left++] = near;
  }
  return best;
}

void TriangleTree::Around::set(const Vector3d& middle, double radius, double distance) {
  constexpr double kRounding = 1 + 1e-9;
  const double farthest = (distance + 2 * radius) * kRounding, most = farthest * farthest;
  middle_ = middle;
  triangles_.clear();
  discs_.conservativeResize(std::max<Eigen::Index>(discs_.rows(), 64), 7);
  std::array<int, kDeepest> open;
  std::size_t left = 0;
  open[left++] = 0;
  while (left > 0) {
    const int index = open[--left];
    const Node& node = tree_.nodes_[static_cast<std::size_t>(index)];
    if (node.box.squaredExteriorDistance(middle) > most) continue;
    for (int i = node.first; i < node.first + node.count; ++i) {
      const Disc& disc = tree_.discs_[static_cast<std::size_t>(i)];
      if (least_squared(disc, middle) > most) continue;
      const auto row = std::ssize(triangles_);
      if (row == discs_.rows()) discs_.conservativeResize(2 * row, 7);
      discs_.row(row) << (disc.middle - middle).cast<float>().transpose(),
          disc.normal.cast<float>().transpose(), static_cast<float>(disc.radius);
      triangles_.push_back(tree_.order_[static_cast<std::size_t>(i)]);
    }
    if (node.count > 0) continue;
    open[left++] = node.first;
    open[left++] = index + 1;
  }
}

TriangleTree::Nearest TriangleTree::Around::nearest(const Vector3d& point, int guess) {
  constexpr float kRounding = 4e-6F;  // of squares, in single precision
  Nearest best{tree_.squared_distance(guess, point), guess};
  const auto count = std::ssize(triangles_);
  const Eigen::Vector3f from = (point - middle_).cast<float>();
  const auto disc = [&](int k) { return discs_.col(k).head(count).array(); };
  const auto x = from.x() - disc(0), y = from.y() - disc(1), z = from.z() - disc(2);
  above_ = (x * disc(3) + y * disc(4) + z * disc(5)).square();
  squared_ = x.square() + y.square() + z.square();
  least_ = ((squared_ * (1 - kRounding) - above_).max(0).sqrt() - disc(6)).max(0).square() +
           above_ - kRounding * squared_;
  for (Eigen::Index k = 0; k < count; ++k) {
    if (double{least_[k]} >= best.squared) continue;
    const int t = triangles_[static_cast<std::size_t>(k)];
    if (const double squared = tree_.squared_distance(t, point); squared < best.squared)
      best = {squared, t};
  }
  return best;
}

double TriangleTree::first_hit(int from, const Vector3d& start, const Vector3d& direction) const {
  const Vector3d inverse = direction.cwiseInverse();
  double first = kNone;
  std::array<int, kDeepest> open;
  std::size_t left = 0;
  open[left++] = 0;
  while (left > 0) {
    const int index = open[--left];
    const Node& node = nodes_[static_cast<std::size_t>(index)];
    if (!meets(node.box, start, inverse, first)) continue;
    for (int i = node.first; i < node.first + node.count; ++i) {
      const int t = order_[static_cast<std::size_t>(i)];
      if (t == from) continue;
      // start + s direction = a + u ab + v ac, by Cramer's rule
      const Vector3d &a = corner(t, 0), ab = corner(t, 1) - a, ac = corner(t, 2) - a;
      const Vector3d to = start - a, across = direction.cross(ac), along = to.cross(ab);
      const double scale = across.dot(ab);
      if (scale == 0) continue;
      const double u = across.dot(to) / scale, v = along.dot(direction) / scale;
      const double s = along.dot(ac) / scale;
      if (u >= 0 && v >= 0 && u + v <= 1 && s >= 0) first = std::min(first, s);
    }
    if (node.count > 0) continue;
    open[left++] = node.first;
    open[left++] = index + 1;
  }
  return first;
}

}  // namespace weft

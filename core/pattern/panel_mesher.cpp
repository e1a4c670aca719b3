#include "core/pattern/panel_mesher.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/pattern/curve.h"
#include "core/pattern/sets.h"
#include "core/pattern/symmetry.h"
#include "core/pattern/triangulation.h"

namespace weft {
namespace {

constexpr double kAlike = 1e-9;  // of an edge: borders that are mirrored are cut alike

std::size_t around(std::size_t i, std::size_t count) { return i < count ? i : i - count; }

// Lines of a border, to be found by place.
class Lines {
 public:
  Lines(const std::vector<Vector2d>& border, double least_cell) : border_(border) {
    low_ = high_ = border[0];
    for (const Vector2d& point : border) low_ = low_.cwiseMin(point), high_ = high_.cwiseMax(point);
    // some cells a line, however large the border's box is
    const double count = 4 * static_cast<double>(border.size());
    cell_ = std::max(least_cell, std::sqrt((high_ - low_).prod() / count));
    columns_ = static_cast<int>((high_.x() - low_.x()) / cell_) + 1;
    rows_ = static_cast<int>((high_.y() - low_.y()) / cell_) + 1;
    cells_.resize(as_index(columns_) * as_index(rows_));
    for (std::size_t i = 0; i < border.size(); ++i) {
      const Vector2d &a = border[i], &b = border[around(i + 1, border.size())];
      for_cells(a.cwiseMin(b), a.cwiseMax(b), [&](std::size_t at) { cells_[at].push_back(i); });
    }
  }

  // Whether one comes nearer than that, m.
  bool is_near(const Vector2d& point, double reach) const {
    bool near = false;
    const Vector2d around_it = Vector2d::Constant(reach);
    for_cells(point - around_it, point + around_it, [&](std::size_t at) {
      for (const std::size_t i : cells_[at]) {
        const Vector2d &a = border_[i], b = border_[around(i + 1, border_.size())] - a;
        const double t = std::clamp((point - a).dot(b) / b.squaredNorm(), 0.0, 1.0);
        near |= (point - a - t * b).norm() < reach;
      }
    });
    return near;
  }

  // Heights at which a vertical line enters and leaves the border.
  std::vector<double> crossings(double x) const {
    std::vector<double> heights;
    for (std::size_t i = 0; i < border_.size(); ++i) {
      const Vector2d &a = border_[i], &b = border_[around(i + 1, border_.size())];
      if ((a.x() < x) == (b.x() < x)) continue;
      heights.push_back(a.y() + (x - a.x()) / (b.x() - a.x()) * (b.y() - a.y()));
    }
    std::sort(heights.begin(), heights.end());
    return heights;
  }

  const Vector2d& low() const { return low_; }
  const Vector2d& high() const { return high_; }

 private:
  template <class Use>
  void for_cells(const Vector2d& from, const Vector2d& to, const Use& use) const {
    const auto cell = [&](double offset, int count) {
      return std::clamp(static_cast<int>(std::floor(offset / cell_)), 0, count - 1);
    };
    for (int row = cell(from.y() - low_.y(), rows_); row <= cell(to.y() - low_.y(), rows_); ++row)
      for (int column = cell(from.x() - low_.x(), columns_);
           column <= cell(to.x() - low_.x(), columns_); ++column)
        use(as_index(row) * as_index(columns_) + as_index(column));
  }

  const std::vector<Vector2d>& border_;
  double cell_;
  Vector2d low_, high_;
  int columns_, rows_;
  std::vector<std::vector<std::size_t>> cells_;
};

// Columns of points along y, half an edge apart from one to the next.
struct Lattice {
  Vector2d anchor;
  double step;  // along y
  double edge;
};

// Points of the lattice inside that are clear of the border, column after column.
std::vector<Vector2d> inner_points(const Lines& lines, const Lattice& lattice) {
  constexpr double kClear = 0.66;  // edges
  const double reach = (kClear - kAlike) * lattice.edge;
  const double apart = lattice.edge * std::numbers::sqrt3 / 2;
  std::vector<Vector2d> points;
  const auto first = static_cast<int>(std::ceil((lines.low().x() - lattice.anchor.x()) / apart));
  const auto last = static_cast<int>(std::floor((lines.high().x() - lattice.anchor.x()) / apart));
  for (int column = first; column <= last; ++column) {
    const double x = lattice.anchor.x() + column * apart;
    const double shift = lattice.anchor.y() + (column % 2 != 0 ? lattice.step / 2 : 0);
    const std::vector<double> heights = lines.crossings(x);
    const auto begin = static_cast<std::ptrdiff_t>(points.size());
    for (std::size_t k = 0; k + 1 < heights.size(); k += 2)
      for (double row = std::ceil((heights[k] - shift) / lattice.step);
           shift + row * lattice.step < heights[k + 1]; ++row) {
        const Vector2d point(x, shift + row * lattice.step);
        if (!lines.is_near(point, reach)) points.push_back(point);
      }
    if (column % 2 != 0) std::reverse(points.begin() + begin, points.end());
  }
  return points;
}

double quality(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
  return cross2(b - a, c - a) / (longest * longest);
}

// Moves inner points towards the middle of their neighbours, where that makes their worst triangle
// no worse.
void smooth(Triangulation& mesh, const std::vector<std::size_t>& movable) {
  constexpr int kRounds = 12;
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<Vector2d>& points = mesh.points();
    const auto triangles = mesh.triangles();
    const std::size_t count = points.size();
    std::vector<Vector2d> sum(count, Vector2d::Zero());
    std::vector<int> neighbours(count, 0);
    std::vector<double> before(count, 1), after(count, 1);
    for (const auto& triangle : triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        const auto i = as_index(triangle[k]);
        sum[i] += points[as_index(triangle[(k + 1) % 3])];
        ++neighbours[i];
      }
    std::vector<Vector2d> wanted = points;
    for (const std::size_t i : movable) wanted[i] = sum[i] / neighbours[i];
    for (const auto& triangle : triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        const auto i = as_index(triangle[k]);
        const Vector2d &b = points[as_index(triangle[(k + 1) % 3])],
                       &c = points[as_index(triangle[(k + 2) % 3])];
        before[i] = std::min(before[i], quality(points[i], b, c));
        after[i] = std::min(after[i], quality(wanted[i], b, c));
      }
    constexpr double kGood = 0.6;
    for (const std::size_t i : movable)
      if (after[i] < std::min(before[i], kGood)) wanted[i] = points[i];
    mesh.move(wanted);
  }
}

std::vector<Vector2d> turned(const std::vector<Vector2d>& points, double angle) {
  const Eigen::Rotation2Dd turn(angle);
  std::vector<Vector2d> result;
  for (const Vector2d& point : points)
    result.push_back(angle == 0 ? point : without_dust(turn * point));
  return result;
}

// The lattice is as it lies with the grain upwards.
PanelMesh fill(const std::vector<Vector2d>& border, double grain, const Lattice& lattice) {
  constexpr double kBand = 2;  // edges: what lies deeper stays a lattice
  const std::vector<Vector2d> upright = turned(border, -grain);
  const Lines lines(upright, lattice.edge);
  const std::vector<Vector2d> inner = inner_points(lines, lattice), points = turned(inner, grain);
  Triangulation mesh(border);
  std::vector<std::size_t> movable;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (mesh.insert(points[i]) && lines.is_near(inner[i], (kBand - kAlike) * lattice.edge))
      movable.push_back(mesh.points().size() - 1);
  smooth(mesh, movable);
  mesh.settle_ties(grain, lattice.anchor.x());
  return {mesh.points(), mesh.triangles()};
}

// The half of a symmetric border that lies right of its axis, and what of it lies on the axis.
struct Half {
  std::vector<Vector2d> border;  // up the right side, then down the axis
  std::vector<int> original;     // of the first of them, in the whole border
  double step = 0;               // of points on the axis, m
};

std::optional<Half> right_half(const std::vector<Vector2d>& border, const Mirror& mirror,
                               double edge) {
  constexpr double kLeastAngle = 0.45;  // that a corner may be parted into, rad
  std::vector<std::size_t> on_axis;
  for (std::size_t i = 0; i < border.size(); ++i)
    if (mirror.image(static_cast<int>(i), border.size()) == static_cast<int>(i))
      on_axis.push_back(i);
  if (on_axis.size() != 2) return std::nullopt;
  auto [low, high] = std::pair(on_axis[0], on_axis[1]);
  if (border[low].y() > border[high].y()) std::swap(low, high);
  Half half;
  for (std::size_t i = low;; i = around(i + 1, border.size())) {
    half.border.push_back(border[i]);
    half.original.push_back(static_cast<int>(i));
    if (i == high) break;
  }
  half.border.front().x() = half.border.back().x() = mirror.axis;
  if (half.border.size() < 3) return std::nullopt;
  const Vector2d begin = half.border[1] - half.border[0],
                 end = half.border[half.border.size() - 2] - half.border.back();
  if (std::min(std::atan2(begin.x(), begin.y()), std::atan2(end.x(), -end.y())) < kLeastAngle)
    return std::nullopt;
  const double length = border[high].y() - border[low].y();
  const double lines = std::max(1.0, std::floor(length / edge + 0.5 - 1e-6));
  half.step = length / lines;
  for (double k = lines - 1; k > 0; --k)
    half.border.emplace_back(mirror.axis, border[low].y() + k * half.step);
  return half;
}

// Both halves of a border from a mesh of the right one.
PanelMesh both_halves(const std::vector<Vector2d>& border, const Mirror& mirror, const Half& half,
                      const PanelMesh& mesh) {
  const auto& [points, triangles] = mesh;
  PanelMesh whole{border, {}};
  std::vector<int> right(points.size()), left(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i < half.original.size()) {
      right[i] = half.original[i];
      left[i] = mirror.image(half.original[i], border.size());
      continue;
    }
    right[i] = left[i] = static_cast<int>(whole.points.size());
    whole.points.push_back(points[i]);
    if (i < half.border.size()) continue;
    left[i] = static_cast<int>(whole.points.size());
    whole.points.push_back(mirror.image(points[i]));
  }
  for (const auto& [a, b, c] : triangles) {
    const auto corner = [](const std::vector<int>& side, int i) { return side[as_index(i)]; };
    whole.triangles.push_back({corner(right, a), corner(right, b), corner(right, c)});
    whole.triangles.push_back({corner(left, a), corner(left, c), corner(left, b)});
  }
  return whole;
}

}  // namespace

PanelMesh mesh_panel(const std::vector<Vector2d>& border, double grain, double edge) {
  const auto mirror = is_square(grain) ? find_mirror(border) : std::nullopt;
  if (const auto half = mirror ? right_half(border, *mirror, edge) : std::nullopt;
      half && !find_crossing(half->border)) {
    // along the axis the lattice has its points
    const bool along = std::abs(std::sin(grain)) < 0.5;
    const Lattice lattice{turned({half->border[0]}, -grain)[0], along ? half->step : edge, edge};
    return both_halves(border, *mirror, *half, fill(half->border, grain, lattice));
  }
  const std::vector<Vector2d> upright = turned(border, -grain);
  Vector2d low = upright[0], high = upright[0];
  for (const Vector2d& point : upright) low = low.cwiseMin(point), high = high.cwiseMax(point);
  return fill(border, grain, {(low + high) / 2, edge, edge});
}

std::optional<std::pair<int, int>> find_crossing(const std::vector<Vector2d>& border) {
  const std::size_t count = border.size();
  const auto end = [&](std::size_t i) -> const Vector2d& { return border[around(i + 1, count)]; };
  std::vector<std::size_t> order(count);  // by their left ends
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto left = [&](std::size_t i) { return std::min(border[i].x(), end(i).x()); };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t i, std::size_t j) { return left(i) < left(j); });
  const auto meet = [&](std::size_t i, std::size_t j) {
    const Vector2d &a = border[i], &b = end(i), &c = border[j], &d = end(j);
    if (std::min(a.y(), b.y()) > std::max(c.y(), d.y()) ||
        std::min(c.y(), d.y()) > std::max(a.y(), b.y()))
      return false;
    if (around(i + 1, count) == j || around(j + 1, count) == i) {
      // neighbours share an end, and meet where they fold back
      const auto [first, last, next] =
          around(i + 1, count) == j ? std::array{a, b, d} : std::array{c, d, b};
      return orientation(first, last, next) == 0 && (last - first).dot(next - last) <= 0;
    }
    const int p = orientation(a, b, c), q = orientation(a, b, d);
    const int r = orientation(c, d, a), s = orientation(c, d, b);
    if (p == 0 && q == 0) {
      const Vector2d low = a.cwiseMin(b).cwiseMax(c.cwiseMin(d)),
                     high = a.cwiseMax(b).cwiseMin(c.cwiseMax(d));
      return low.x() <= high.x() && low.y() <= high.y();
    }
    return p * q <= 0 && r * s <= 0;
  };
  std::vector<std::size_t> open;
  for (const std::size_t i : order) {
    std::erase_if(open,
                  [&](std::size_t j) { return std::max(border[j].x(), end(j).x()) < left(i); });
    for (const std::size_t j : open)
      if (meet(i, j))
        return std::pair(static_cast<int>(std::min(i, j)), static_cast<int>(std::max(i, j)));
    open.push_back(i);
  }
  return std::nullopt;
}

double area_within(const std::vector<Vector2d>& border) {
  double twice = 0;
  for (std::size_t i = 0; i < border.size(); ++i)
    twice += cross2(border[i] - border[0], border[around(i + 1, border.size())] - border[0]);
  return twice / 2;
}

double least_height(const std::array<Vector2d, 3>& triangle) {
  const auto& [a, b, c] = triangle;
  const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
  return cross2(b - a, c - a) / longest;
}

}  // namespace weft

#include "core/pattern/panel_mesher.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>

#include "core/pattern/curve.h"
#include "core/pattern/sets.h"
#include "core/pattern/symmetry.h"
#include "core/pattern/triangulation.h"

namespace weft {
namespace {

constexpr double kAlike = 1e-9;  // of an edge: borders that are mirrored are cut alike

std::size_t around(std::size_t i, std::size_t count) { return i < count ? i : i - count; }

// Columns of points along y, half an edge apart from one to the next.
struct Lattice {
  Vector2d anchor;
  double step;  // along y
  double edge;
};

// Points of the lattice inside that are clear of all lines, column after column.
std::vector<Vector2d> inner_points(const LineGrid& lines, const Lattice& lattice) {
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

PanelLines turned(const PanelLines& lines, double angle) {
  return {turned(lines.border, angle), turned(lines.inside, angle), lines.creases};
}

// The lattice is as it lies with the grain upwards.
PanelMesh fill(const PanelLines& lines, double grain, const Lattice& lattice) {
  constexpr double kBand = 2;  // edges: what lies deeper stays a lattice
  const PanelLines upright = turned(lines, -grain);
  const LineGrid grid(upright, lattice.edge);
  const std::vector<Vector2d> inner = inner_points(grid, lattice), points = turned(inner, grain);
  Triangulation mesh(lines.border);
  for (const Vector2d& point : lines.inside) mesh.insert(point);
  for (const std::vector<int>& crease : lines.creases) mesh.keep(crease);
  std::vector<std::size_t> movable;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (mesh.insert(points[i]) && grid.is_near(inner[i], (kBand - kAlike) * lattice.edge))
      movable.push_back(mesh.points().size() - 1);
  smooth(mesh, movable);
  mesh.settle_ties(grain, lattice.anchor.x());
  return {mesh.points(), mesh.triangles()};
}

// The image of each point of a symmetric border and of its creases; none where these have none, or
// cross the axis between two points.
std::vector<int> images_of(const PanelLines& lines, const Mirror& mirror) {
  const std::size_t border = lines.border.size();
  std::vector<int> images;
  for (std::size_t i = 0; i < border; ++i)
    images.push_back(mirror.image(static_cast<int>(i), border));
  const auto alike = [](const Vector2d& a, const Vector2d& b) {
    return (a - b).lpNorm<Eigen::Infinity>() <= kMicrometre;
  };
  std::vector<std::size_t> order(lines.inside.size());  // by height
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto lower = [&](std::size_t i, double v) { return lines.inside[i].y() < v; };
  std::sort(order.begin(), order.end(),
            [&](std::size_t i, std::size_t j) { return lower(i, lines.inside[j].y()); });
  for (const Vector2d& point : lines.inside) {
    const Vector2d wanted = mirror.image(point);
    auto at = std::lower_bound(order.begin(), order.end(), wanted.y() - kMicrometre, lower);
    while (at != order.end() && lines.inside[*at].y() <= wanted.y() + kMicrometre &&
           !alike(lines.inside[*at], wanted))
      ++at;
    if (at == order.end() || !alike(lines.inside[*at], wanted)) return {};
    images.push_back(static_cast<int>(border + *at));
  }
  std::set<std::pair<int, int>> all;
  for (const auto& [a, b] : lines.all()) all.insert(std::minmax(a, b));
  for (const auto& [a, b] : all) {
    const double from = lines.point(a).x() - mirror.axis, to = lines.point(b).x() - mirror.axis;
    const bool inside = as_index(a) >= border || as_index(b) >= border;
    if (inside && std::min(from, to) < -kMicrometre && std::max(from, to) > kMicrometre) return {};
    if (!all.contains(std::minmax(images[as_index(a)], images[as_index(b)]))) return {};
  }
  return images;
}

// What of a symmetric panel lies right of its axis, and on it.
struct Half {
  PanelLines lines;           // the border up the right side, then down the axis
  std::vector<int> original;  // of each point in the whole panel; -1: of none
  double step = 0;            // of points on the axis, m
};

// images: of all points of the panel.
std::optional<Half> right_half(const PanelLines& whole, const Mirror& mirror,
                               const std::vector<int>& images, double edge) {
  constexpr double kLeastAngle = 0.45;  // that a corner may be parted into, rad
  const std::vector<Vector2d>& border = whole.border;
  std::vector<int> on_axis;  // upwards
  for (std::size_t i = 0; i < border.size(); ++i)
    if (images[i] == static_cast<int>(i)) on_axis.push_back(static_cast<int>(i));
  if (on_axis.size() != 2) return std::nullopt;
  const auto height = [&](int i) { return whole.point(i).y(); };
  const auto lower = [&](int i, int j) { return height(i) < height(j); };
  if (lower(on_axis[1], on_axis[0])) std::swap(on_axis[0], on_axis[1]);
  const int low = on_axis[0], high = on_axis[1];
  Half half;
  std::vector<Vector2d>& outline = half.lines.border;
  for (std::size_t i = as_index(low);; i = around(i + 1, border.size())) {
    outline.push_back(border[i]);
    half.original.push_back(static_cast<int>(i));
    if (i == as_index(high)) break;
  }
  outline.front().x() = outline.back().x() = mirror.axis;
  if (outline.size() < 3) return std::nullopt;
  const Vector2d begin = outline[1] - outline[0],
                 end = outline[outline.size() - 2] - outline.back();
  if (std::min(std::atan2(begin.x(), begin.y()), std::atan2(end.x(), -end.y())) < kLeastAngle)
    return std::nullopt;

  // down the axis, by points of creases there
  for (std::size_t i = border.size(); i < images.size(); ++i)
    if (images[i] == static_cast<int>(i)) on_axis.push_back(static_cast<int>(i));
  std::sort(on_axis.begin(), on_axis.end(), lower);
  std::set<std::pair<int, int>> creased;
  for (const std::vector<int>& crease : whole.creases)
    for (std::size_t k = 0; k + 1 < crease.size(); ++k)
      creased.insert(std::minmax(crease[k], crease[k + 1]));
  half.step = edge;
  for (std::size_t n = on_axis.size() - 1; n > 0; --n) {
    const double from = height(on_axis[n - 1]), length = height(on_axis[n]) - from;
    const bool one = creased.contains(std::minmax(on_axis[n - 1], on_axis[n]));
    const double lines = one ? 1 : std::max(1.0, parts_of(length, edge));
    if (on_axis.size() == 2) half.step = length / lines;
    for (double k = lines - 1; k > 0; --k) {
      outline.emplace_back(mirror.axis, from + k * length / lines);
      half.original.push_back(-1);
    }
    if (n == 1) continue;
    outline.emplace_back(mirror.axis, from);
    half.original.push_back(on_axis[n - 1]);
  }

  // creases on the right
  for (std::size_t i = border.size(); i < images.size(); ++i) {
    const int point = static_cast<int>(i);
    if (images[i] == point || whole.point(point).x() < mirror.axis) continue;
    half.lines.inside.push_back(whole.point(point));
    half.original.push_back(point);
  }
  std::map<int, int> number;
  for (std::size_t i = 0; i < half.original.size(); ++i)
    number[half.original[i]] = static_cast<int>(i);
  for (const auto& [a, b] : creased)
    if (number.contains(a) && number.contains(b) &&
        (images[as_index(a)] != a || images[as_index(b)] != b))
      half.lines.creases.push_back({number[a], number[b]});
  return half;
}

// Both halves of a panel from a mesh of the right one.
PanelMesh both_halves(const PanelLines& lines, const Mirror& mirror, const std::vector<int>& images,
                      const Half& half, const PanelMesh& mesh) {
  const auto& [points, triangles] = mesh;
  PanelMesh whole{lines.border, {}};
  whole.points.insert(whole.points.end(), lines.inside.begin(), lines.inside.end());
  std::vector<int> right(points.size()), left(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i < half.original.size() && half.original[i] >= 0) {
      right[i] = half.original[i];
      left[i] = images[as_index(half.original[i])];
      continue;
    }
    right[i] = left[i] = static_cast<int>(whole.points.size());
    whole.points.push_back(points[i]);
    if (i < half.original.size()) continue;
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

// Of a panel with an axis u = constant that passes two of its border's points; or none.
std::optional<PanelMesh> mesh_symmetric(const PanelLines& lines, double grain, double edge) {
  const auto mirror = find_mirror(lines.border);
  if (!mirror) return std::nullopt;
  const std::vector<int> images = images_of(lines, *mirror);
  if (images.empty()) return std::nullopt;
  const auto half = right_half(lines, *mirror, images, edge);
  if (!half || find_crossing(half->lines) || find_tight(half->lines, kCreaseRoom * edge))
    return std::nullopt;
  // along the axis the lattice has its points
  const bool along = std::abs(std::sin(grain)) < 0.5;
  const Lattice lattice{turned({half->lines.border[0]}, -grain)[0], along ? half->step : edge,
                        edge};
  return both_halves(lines, *mirror, images, *half, fill(half->lines, grain, lattice));
}

}  // namespace

PanelMesh mesh_panel(const PanelLines& lines, double grain, double edge) {
  if (is_square(grain))
    if (auto mesh = mesh_symmetric(lines, grain, edge)) return *std::move(mesh);
  const std::vector<Vector2d> upright = turned(lines.border, -grain);
  Vector2d low = upright[0], high = upright[0];
  for (const Vector2d& point : upright) low = low.cwiseMin(point), high = high.cwiseMax(point);
  return fill(lines, grain, {(low + high) / 2, edge, edge});
}

double least_height(const std::array<Vector2d, 3>& triangle) {
  const auto& [a, b, c] = triangle;
  const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
  return cross2(b - a, c - a) / longest;
}

}  // namespace weft

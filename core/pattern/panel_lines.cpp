#include "core/pattern/panel_lines.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/pattern/triangulation.h"

namespace weft {

std::vector<std::array<int, 2>> PanelLines::all() const {
  std::vector<std::array<int, 2>> ends;
  const int count = static_cast<int>(border.size());
  for (int i = 0; i < count; ++i) ends.push_back({i, (i + 1) % count});
  for (const std::vector<int>& crease : creases)
    for (std::size_t k = 0; k + 1 < crease.size(); ++k) ends.push_back({crease[k], crease[k + 1]});
  return ends;
}

LineGrid::LineGrid(const PanelLines& lines, double least_cell) : lines_(lines), ends_(lines.all()) {
  low_ = high_ = lines.border[0];
  for (const Vector2d& point : lines.border)
    low_ = low_.cwiseMin(point), high_ = high_.cwiseMax(point);
  // some cells a line, however large the border's box is
  const double count = 4 * static_cast<double>(lines.border.size());
  cell_ = std::max(least_cell, std::sqrt((high_ - low_).prod() / count));
  columns_ = static_cast<int>((high_.x() - low_.x()) / cell_) + 1;
  rows_ = static_cast<int>((high_.y() - low_.y()) / cell_) + 1;
  cells_.resize(as_index(columns_) * as_index(rows_));
  for (std::size_t i = 0; i < ends_.size(); ++i) {
    const Vector2d &a = lines.point(ends_[i][0]), &b = lines.point(ends_[i][1]);
    for_cells(a.cwiseMin(b), a.cwiseMax(b),
              [&](std::size_t at) { cells_[at].push_back(static_cast<int>(i)); });
  }
}

double LineGrid::distance(const Vector2d& point, int line) const {
  const auto& ends = ends_[as_index(line)];
  const Vector2d &a = lines_.point(ends[0]), b = lines_.point(ends[1]) - a;
  const double t = std::clamp((point - a).dot(b) / b.squaredNorm(), 0.0, 1.0);
  return (point - a - t * b).norm();
}

std::vector<double> LineGrid::crossings(double u) const {
  std::vector<double> heights;
  const std::vector<Vector2d>& border = lines_.border;
  for (std::size_t i = 0; i < border.size(); ++i) {
    const Vector2d &a = border[i], &b = border[i + 1 < border.size() ? i + 1 : 0];
    if ((a.x() < u) == (b.x() < u)) continue;
    heights.push_back(a.y() + (u - a.x()) / (b.x() - a.x()) * (b.y() - a.y()));
  }
  std::sort(heights.begin(), heights.end());
  return heights;
}

std::optional<std::pair<int, int>> find_crossing(const PanelLines& lines) {
  const std::vector<std::array<int, 2>> ends = lines.all();
  const std::size_t count = ends.size();
  const auto point = [&](std::size_t line, std::size_t k) -> const Vector2d& {
    return lines.point(ends[line][k]);
  };
  std::vector<std::size_t> order(count);  // by their left ends
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto left = [&](std::size_t i) { return std::min(point(i, 0).x(), point(i, 1).x()); };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t i, std::size_t j) { return left(i) < left(j); });
  const auto meet = [&](std::size_t i, std::size_t j) {
    const Vector2d &a = point(i, 0), &b = point(i, 1), &c = point(j, 0), &d = point(j, 1);
    if (std::min(a.y(), b.y()) > std::max(c.y(), d.y()) ||
        std::min(c.y(), d.y()) > std::max(a.y(), b.y()))
      return false;
    for (const std::size_t k : {0U, 1U})
      for (const std::size_t l : {0U, 1U})
        if (ends[i][k] == ends[j][l]) {
          // they meet where they fold back from their common end
          const Vector2d &first = point(i, 1 - k), &last = point(i, k), &next = point(j, 1 - l);
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
    std::erase_if(
        open, [&](std::size_t j) { return std::max(point(j, 0).x(), point(j, 1).x()) < left(i); });
    for (const std::size_t j : open)
      if (meet(i, j))
        return std::pair(static_cast<int>(std::min(i, j)), static_cast<int>(std::max(i, j)));
    open.push_back(i);
  }
  return std::nullopt;
}

std::optional<std::pair<int, int>> find_tight(const PanelLines& lines, double least) {
  if (lines.creases.empty()) return std::nullopt;
  const LineGrid grid(lines, least);
  const std::vector<std::array<int, 2>> ends = lines.all();
  const int border = static_cast<int>(lines.border.size());
  const auto neighbours = [&](int i, int j) {
    const int apart = std::abs(i - j);
    return i < border && j < border && (apart == 1 || apart == border - 1);
  };
  for (int i = 0; i < border + static_cast<int>(lines.inside.size()); ++i) {
    int found = -1;
    grid.for_near(lines.point(i), least, [&](int line) {
      const auto [a, b] = ends[as_index(line)];
      if (a == i || b == i || (i < border && line < border)) return;
      if (neighbours(i, a) || neighbours(i, b)) return;
      if (found < 0 || line < found) found = line;
    });
    if (found >= 0) return std::pair(i, found);
  }
  return std::nullopt;
}

bool is_within(const std::vector<Vector2d>& border, const Vector2d& point) {
  bool within = false;
  for (std::size_t i = 0; i < border.size(); ++i) {
    const Vector2d &a = border[i], &b = border[i + 1 < border.size() ? i + 1 : 0];
    if ((a.x() < point.x()) == (b.x() < point.x())) continue;
    within ^= a.y() + (point.x() - a.x()) / (b.x() - a.x()) * (b.y() - a.y()) < point.y();
  }
  return within;
}

double area_within(const std::vector<Vector2d>& border) {
  double twice = 0;
  for (std::size_t i = 0; i < border.size(); ++i)
    twice += cross2(border[i] - border[0], border[i + 1 < border.size() ? i + 1 : 0] - border[0]);
  return twice / 2;
}

}  // namespace weft

#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/pattern/curve.h"
#include "core/pattern/sets.h"

namespace weft {

// How many lines of about `edge` a length is; where two counts fit as well, the lesser, whatever
// rounding says.
inline double parts_of(double length, double edge) {
  constexpr double kRounding = 1e-6;
  return std::floor(length / edge + 0.5 - kRounding);
}

// The lines that triangles of a panel have edges along. They are numbered: the border's, each from
// the point of that number to the next, then those of one crease after the other.
struct PanelLines {
  std::vector<Vector2d> border;                // anticlockwise, m
  std::vector<Vector2d> inside = {};           // points of creases inside it, m
  std::vector<std::vector<int>> creases = {};  // points of each; those inside follow the border's

  const Vector2d& point(int i) const {
    return as_index(i) < border.size() ? border[as_index(i)] : inside[as_index(i) - border.size()];
  }
  std::vector<std::array<int, 2>> all() const;  // both points of each line
};

// The lines of a panel, to be found by place.
class LineGrid {
 public:
  LineGrid(const PanelLines& lines, double least_cell);

  // Calls use(line) for lines that come nearer than that, m, some of them several times.
  template <class Use>
  void for_near(const Vector2d& point, double reach, const Use& use) const {
    const Vector2d around_it = Vector2d::Constant(reach);
    for_cells(point - around_it, point + around_it, [&](std::size_t at) {
      for (const int line : cells_[at])
        if (distance(point, line) < reach) use(line);
    });
  }
  bool is_near(const Vector2d& point, double reach) const {
    bool near = false;
    for_near(point, reach, [&](int) { near = true; });
    return near;
  }
  double distance(const Vector2d& point, int line) const;  // m
  // Heights at which a vertical line enters and leaves the border.
  std::vector<double> crossings(double u) const;

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

  const PanelLines& lines_;
  std::vector<std::array<int, 2>> ends_;
  double cell_;  // m
  Vector2d low_, high_;
  int columns_, rows_;
  std::vector<std::vector<int>> cells_;
};

// Two lines that meet elsewhere than in a common end.
std::optional<std::pair<int, int>> find_crossing(const PanelLines& lines);

// Creases leave triangles room where points inside are at least so far from other lines, and they
// from points of the border, in edges of triangles.
inline constexpr double kCreaseRoom = 0.4;

// A point of a crease or of the border, and a line that is nearer to it than that, m, of which one
// belongs to a crease; neighbours along the border of a crease's end do not count.
std::optional<std::pair<int, int>> find_tight(const PanelLines& lines, double least);

bool is_within(const std::vector<Vector2d>& border, const Vector2d& point);

double area_within(const std::vector<Vector2d>& border);  // m^2, below 0 where it runs clockwise

}  // namespace weft

#include "core/pattern/creases.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/model/text.h"
#include "core/pattern/folded_panel.h"
#include "core/pattern/symmetry.h"

namespace weft {
namespace {

constexpr double kCorner = std::numbers::pi / 6;  // turns of a line that are kept, rad

double turn_at(const Vector2d& before, const Vector2d& at, const Vector2d& after) {
  const Vector2d one = at - before, two = after - at;
  return std::abs(std::atan2(cross2(one, two), one.dot(two)));
}

std::string place(const Vector2d& point) { return join("(", point.x(), ", ", point.y(), ") m"); }

// Of which crease a line of the panel is; -1: of the border.
int crease_of(const PanelLines& lines, int line) {
  int left = line - static_cast<int>(lines.border.size());
  if (left < 0) return -1;
  for (std::size_t c = 0; c < lines.creases.size(); ++c) {
    left -= static_cast<int>(lines.creases[c].size()) - 1;
    if (left < 0) return static_cast<int>(c);
  }
  return -1;
}

int crease_with(const PanelLines& lines, int point) {
  for (std::size_t c = 0; c < lines.creases.size(); ++c)
    if (std::ranges::count(lines.creases[c], point) > 0) return static_cast<int>(c);
  return -1;
}

}  // namespace

std::optional<OutlinePlace> nearest_place(const std::vector<Curve>& outline, const Vector2d& point,
                                          double reach) {
  constexpr int kParts = 64, kRounds = 60;
  std::optional<OutlinePlace> nearest;
  for (std::size_t e = 0; e < outline.size(); ++e) {
    const auto distance = [&](double share) { return (outline[e].at(share) - point).norm(); };
    int best = 0;
    double least = distance(0);
    for (int k = 1; k <= kParts; ++k)
      if (const double here = distance(static_cast<double>(k) / kParts); here < least)
        best = k, least = here;
    // between its neighbours the distance has one minimum
    double low = std::max(0, best - 1), high = std::min(kParts, best + 1);
    for (int round = 0; round < kRounds; ++round) {
      const double one = low + (high - low) / 3, two = high - (high - low) / 3;
      (distance(one / kParts) < distance(two / kParts) ? high : low) =
          distance(one / kParts) < distance(two / kParts) ? two : one;
    }
    const double share = (low + high) / 2 / kParts;
    if (distance(share) < reach) reach = distance(share), nearest = {static_cast<int>(e), share};
  }
  return nearest;
}

std::vector<Vector2d> follow(const std::vector<Vector2d>& line, double edge,
                             std::optional<double> axis) {
  // the line in pieces, each of which is divided evenly
  std::vector<std::vector<Vector2d>> pieces = {{line[0]}};
  const auto side = [&](const Vector2d& point) {
    const double beside = point.x() - *axis;
    return std::abs(beside) <= kMicrometre ? 0 : beside < 0 ? -1 : 1;
  };
  for (std::size_t i = 1; i < line.size(); ++i) {
    const Vector2d &from = line[i - 1], &to = line[i];
    if (from == to) continue;
    if (axis && side(from) * side(to) < 0) {
      const double part = (*axis - from.x()) / (to.x() - from.x());
      const Vector2d on_axis(*axis, from.y() + part * (to.y() - from.y()));
      pieces.back().push_back(on_axis);
      pieces.push_back({on_axis});
    }
    pieces.back().push_back(to);
    if (i + 1 == line.size()) break;
    const bool meets_axis = axis && side(to) == 0 && (side(from) != 0 || side(line[i + 1]) != 0);
    if (meets_axis || turn_at(from, to, line[i + 1]) > kCorner) pieces.push_back({to});
  }
  std::vector<Vector2d> points = {line[0]};
  for (const std::vector<Vector2d>& piece : pieces) {
    double length = 0;
    for (std::size_t i = 1; i < piece.size(); ++i) length += (piece[i] - piece[i - 1]).norm();
    if (length == 0) continue;
    const double count = std::max(1.0, parts_of(length, edge));
    double along = 0;
    int next = 1;
    for (std::size_t i = 1; i < piece.size(); ++i) {
      const double part = (piece[i] - piece[i - 1]).norm();
      for (; next < count && next * length / count <= along + part; ++next)
        points.emplace_back(piece[i - 1] +
                            (next * length / count - along) / part * (piece[i] - piece[i - 1]));
      along += part;
    }
    points.push_back(piece.back());
  }
  return points;
}

std::vector<Problem> crease_problems(const PatternPanel& panel, const Border& border, double edge,
                                     const std::string& path) {
  const PanelLines& lines = border.lines;
  std::vector<Problem> problems;
  const auto problem = [&](int crease, const std::string& message) {
    problems.push_back({join(path, ".creases[", crease, "].points_m"),
                        join("crease ", crease, " of panel ", panel.name, " ", message)});
  };
  const auto on_border = [&](int i) { return as_index(i) < lines.border.size(); };
  // inner points as they were given, and the ends where they were not taken to the outline
  for (std::size_t c = 0; c < lines.creases.size(); ++c) {
    const auto& points = panel.creases[c].points;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool taken = (i == 0 && on_border(lines.creases[c].front())) ||
                         (i + 1 == points.size() && on_border(lines.creases[c].back()));
      if (taken || is_within(lines.border, points[i])) continue;
      problem(static_cast<int>(c),
              join("leaves it: point ", i, ", ", place(points[i]), ", is outside of its outline"));
      break;
    }
  }
  if (!problems.empty()) return problems;

  const std::vector<std::array<int, 2>> ends = lines.all();
  const auto edge_with = [&](int line) {
    for (std::size_t e = 0; e < border.edges.size(); ++e)
      for (std::size_t i = 0; i + 1 < border.edges[e].size(); ++i)
        if (border.edges[e][i] == line) return e;
    return border.edges.size();
  };
  const auto name_of = [&](int crease, int line) {
    const int other = crease_of(lines, line);
    return other < 0         ? join("edge ", edge_with(line))
           : other == crease ? std::string("itself")
                             : join("crease ", other);
  };
  if (const auto crossing = find_crossing(lines)) {
    const int crease = crease_of(lines, crossing->second);
    problem(crease, join("crosses or touches ", name_of(crease, crossing->first), " near ",
                         place(lines.point(ends[as_index(crossing->second)][0]))));
    return problems;
  }
  for (std::size_t c = 0; c < lines.creases.size(); ++c) {
    const auto& crease = lines.creases[c];
    const Vector2d middle = (lines.point(crease[0]) + lines.point(crease[1])) / 2;
    if (!is_within(lines.border, middle))
      problem(static_cast<int>(c), join("leaves it near ", place(middle)));
  }
  if (!problems.empty()) return problems;
  for (std::size_t c = 0; c < lines.creases.size(); ++c) {
    const auto& [points, angle, start_angle] = panel.creases[c];
    const auto& crease = lines.creases[c];
    const bool parts_it = on_border(crease.front()) && on_border(crease.back());
    if (start_angle == 0 || (parts_it && leads_on(points))) continue;
    problems.push_back(
        {join(path, ".creases[", c, "].start_rad"),
         join("is ", start_angle, " rad, but crease ", c, " of panel ", panel.name,
              parts_it
                  ? " turns back: a panel starts folded along lines that lead on"
                  : " ends inside it: a panel starts folded along lines from outline to outline")});
  }
  if (const auto tight = find_tight(lines, kCreaseRoom * edge)) {
    const auto [point, line] = *tight;
    const bool at_border = as_index(point) < lines.border.size();
    const int crease = at_border ? crease_of(lines, line) : crease_with(lines, point);
    const double distance = LineGrid(lines, edge).distance(lines.point(point), line);
    // of a point of the border, the line that begins there
    problem(crease, join("comes within ", distance * 1e3, " mm of ",
                         name_of(crease, at_border ? point : line), " near ",
                         place(lines.point(point)), ": triangles of ", edge * 1e3,
                         " mm have room from ", kCreaseRoom * edge * 1e3, " mm on"));
  }
  return problems;
}

}  // namespace weft

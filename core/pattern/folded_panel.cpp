#include "core/pattern/folded_panel.h"

#include <algorithm>
#include <map>
#include <utility>

#include "core/pattern/symmetry.h"

namespace weft {
namespace {

// A line that a panel is folded along.
class FoldLine {
 public:
  // along: a vector
  FoldLine(std::vector<Vector2d> points, const Vector2d& along, double angle)
      : points_(std::move(points)),
        along_(along.normalized()),
        turn_(Eigen::AngleAxisd(angle, Vector3d(along_.x(), along_.y(), 0))) {}

  // `at`: where a point of the plane has come to by folds beyond this one.
  Vector3d fold(const Vector2d& point, const Vector3d& at, bool is_left) const {
    const Vector2d beside = this->beside(point);
    const Vector3d pivot(beside.x(), beside.y(), 0);
    return pivot + (is_left ? turn_ : turn_.conjugate()) * (at - pivot);
  }

 private:
  Vector2d beside(const Vector2d& point) const {
    const double height = point.dot(along_);
    const auto next = std::ranges::find_if(
        points_, [&](const Vector2d& each) { return each.dot(along_) > height; });
    if (next == points_.begin())
      return points_.front() - along_ * (points_.front() - point).dot(along_);
    if (next == points_.end())
      return points_.back() + along_ * (point - points_.back()).dot(along_);
    const Vector2d &from = *std::prev(next), line = *next - from;
    return from + line * ((height - from.dot(along_)) / line.dot(along_));
  }

  std::vector<Vector2d> points_;
  Vector2d along_;
  Quaterniond turn_;
};

// The ends of the longest part from point to point, the first of those that are as long.
std::pair<Vector2d, Vector2d> longest_of(const std::vector<Vector2d>& line) {
  std::size_t longest = 1;
  const auto length = [&](std::size_t i) { return (line[i] - line[i - 1]).norm(); };
  for (std::size_t i = 2; i < line.size(); ++i)
    if (length(i) > length(longest) + kMicrometre) longest = i;
  return {line[longest - 1], line[longest]};
}

// A fold between a part of a panel and the part that stays, and on which side of it that is.
struct CrossedFold {
  int crease;
  bool is_left;
};
// From the part that stays outwards.
using Way = std::vector<CrossedFold>;

std::vector<FoldLine> fold_lines(const PatternPanel& panel,
                                 const std::vector<std::vector<int>>& creases,
                                 const PanelMesh& mesh, bool is_turned) {
  std::vector<FoldLine> lines;
  for (std::size_t c = 0; c < creases.size(); ++c) {
    std::vector<Vector2d> points;
    for (const int i : creases[c]) points.push_back(mesh.points[as_index(i)]);
    // a straight one may have been moved to the outline
    const auto [begin, end] = longest_of(panel.creases[c].points);
    const bool is_straight = panel.creases[c].points.size() == 2;
    const Vector2d along = is_straight ? points.back() - points.front() : end - begin;
    const double angle = panel.creases[c].start_angle;
    lines.emplace_back(std::move(points), along, is_turned ? -angle : angle);
  }
  return lines;
}

// Of each triangle.
std::vector<Way> find_ways(const PatternPanel& panel, const std::vector<std::vector<int>>& creases,
                           const PanelMesh& mesh, int fixed) {
  using Line = std::pair<int, int>;
  const auto line_of = [&](std::size_t t, std::size_t k) -> Line {
    return {mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]};
  };
  std::map<Line, std::size_t> triangle_at;  // that runs so around, anticlockwise
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) triangle_at[line_of(t, k)] = t;
  std::map<Line, CrossedFold> fold_at;  // of which that triangle is beyond
  for (std::size_t c = 0; c < creases.size(); ++c)
    for (std::size_t i = 1; panel.creases[c].start_angle != 0 && i < creases[c].size(); ++i) {
      const int from = creases[c][i - 1], to = creases[c][i];
      fold_at[{from, to}] = {static_cast<int>(c), true};
      fold_at[{to, from}] = {static_cast<int>(c), false};
    }

  std::vector<Way> ways(mesh.triangles.size());
  const auto first = std::ranges::find_if(mesh.triangles, [&](const auto& triangle) {
    return std::ranges::count(triangle, fixed) > 0;
  });
  std::vector<std::size_t> to_visit = {static_cast<std::size_t>(first - mesh.triangles.begin())};
  std::vector<bool> is_known(mesh.triangles.size());
  is_known[to_visit[0]] = true;
  while (!to_visit.empty()) {
    const std::size_t t = to_visit.back();
    to_visit.pop_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [from, to] = line_of(t, k);
      const auto other = triangle_at.find({to, from});
      if (other == triangle_at.end() || is_known[other->second]) continue;
      is_known[other->second] = true;
      ways[other->second] = ways[t];
      if (const auto fold = fold_at.find({to, from}); fold != fold_at.end())
        ways[other->second].push_back(fold->second);
      to_visit.push_back(other->second);
    }
  }
  return ways;
}

}  // namespace

bool starts_folded(const PatternPanel& panel) {
  return std::ranges::any_of(panel.creases,
                             [](const PatternCrease& crease) { return crease.start_angle != 0; });
}

bool leads_on(const std::vector<Vector2d>& line) {
  const auto [from, to] = longest_of(line);
  for (std::size_t i = 1; i < line.size(); ++i)
    if (line[i] != line[i - 1] && !((line[i] - line[i - 1]).dot(to - from) > 0)) return false;
  return true;
}

std::vector<Vector3d> folded_points(const PatternPanel& panel,
                                    const std::vector<std::vector<int>>& creases,
                                    const PanelMesh& mesh, int fixed, bool is_turned) {
  const std::vector<FoldLine> lines = fold_lines(panel, creases, mesh, is_turned);
  const std::vector<Way> ways = find_ways(panel, creases, mesh, fixed);
  std::vector<Vector3d> folded(mesh.points.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const int i : mesh.triangles[t]) {
      const Vector2d& point = mesh.points[as_index(i)];
      Vector3d at(point.x(), point.y(), 0);
      for (auto fold = ways[t].rbegin(); fold != ways[t].rend(); ++fold)
        at = lines[as_index(fold->crease)].fold(point, at, fold->is_left);
      folded[as_index(i)] = at;
    }
  return folded;
}

}  // namespace weft

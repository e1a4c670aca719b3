#include "core/around_bodies.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <queue>
#include <utility>

#include "core/frame_values.h"
#include "core/triangles/triangles.h"

namespace weft {
namespace {

constexpr double kSpacing = 0.015;  // of points of a line that is drawn tight, m
constexpr double kFree = 0.1;       // shorter than around any limb, m
constexpr double kDeep = 0.04;      // in a body: no arm is that wide, a head is, m
constexpr double kHole = 0.25;      // a border that is shorter may be a hole, m
constexpr double kTube = 0.05;      // how far inwards a tube is about as wide, m
constexpr double kStep = 0.025;     // from line to line inwards, m

using Line = std::vector<Vector3d>;  // closed, m
using Edge = std::pair<int, int>;    // the lower particle first

Edge edge_of(int i, int j) { return {std::min(i, j), std::max(i, j)}; }

double length_of(const Line& line) {
  double length = 0;
  for (std::size_t i = 0; i < line.size(); ++i)
    length += (line[(i + 1) % line.size()] - line[i]).norm();
  return length;
}

// With points at equal distances.
Line resampled(const Line& line, std::size_t count) {
  const double step = length_of(line) / static_cast<double>(count);
  Line points;
  double ahead = 0;  // from the piece's start to the next point
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Vector3d along = line[(i + 1) % line.size()] - line[i];
    const double length = along.norm();
    for (; ahead < length && points.size() < count; ahead += step)
      points.push_back(line[i] + ahead / length * along);
    ahead -= length;
  }
  return points;
}

// Whether a line gets stuck where it is drawn tight outside of the bodies: its points go to the
// middle between their neighbours, as long as that shortens it about as fast as it would a circle.
template <class Outside>
bool is_stuck(Line line, const Outside& outside) {
  for (double length = length_of(line); length > kFree;) {
    line = resampled(line, static_cast<std::size_t>(std::clamp(length / kSpacing, 24.0, 200.0)));
    const auto n = line.size();
    const double rate = (1 - std::cos(2 * std::numbers::pi / static_cast<double>(n))) / 2;
    const int steps = static_cast<int>(0.2 / rate);
    for (int step = 0; step < steps; ++step) {
      const Line before = line;
      for (std::size_t i = 0; i < n; ++i)
        line[i] = outside((before[(i + n - 1) % n] + 2 * before[i] + before[(i + 1) % n]) / 4);
    }
    const double now = length_of(line);
    if (now > 0.97 * length) return true;
    length = now;
  }
  return false;
}

// Whether a part of the bodies is deep within a line, as a head is in a hood.
template <class Depth>
bool holds_part(const Line& line, const Depth& depth) {
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& point : line) middle += point / static_cast<double>(line.size());
  for (const Vector3d& point : line)
    for (double share = 0; share < 1; share += 0.125)
      if (depth(middle + share * (point - middle)) > kDeep) return true;
  return false;
}

// The cloth of a sheet, as lines in it are read.
class SewnCloth {
 public:
  SewnCloth(const TriangleMesh& mesh, const Matrix3Xd& x) : mesh_(mesh), x_(x) {
    std::map<Edge, int> uses;
    beside_.resize(static_cast<std::size_t>(x.cols()));
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const int i = mesh.triangles[t][k], j = mesh.triangles[t][(k + 1) % 3];
        ++uses[edge_of(i, j)];
        const double length = (flat_corner(mesh, t, k) - flat_corner(mesh, t, (k + 1) % 3)).norm();
        beside_[static_cast<std::size_t>(i)].push_back({length, j});
        beside_[static_cast<std::size_t>(j)].push_back({length, i});
      }
    for (const auto& [edge, count] : uses)
      if (count == 1)
        next_[edge.first].push_back(edge.second), next_[edge.second].push_back(edge.first);
  }

  // Particles of each border, one after the other.
  std::vector<std::vector<int>> borders() const {
    std::map<int, std::vector<int>> left = next_;
    std::vector<std::vector<int>> all;
    for (auto& [start, ways] : left)
      while (!ways.empty()) {
        std::vector<int>& border = all.emplace_back();
        int at = start;
        do {
          border.push_back(at);
          const int to = left[at].back();
          left[at].pop_back();
          std::erase(left[to], at);
          at = to;
        } while (at != start && !left[at].empty());
      }
    return all;
  }

  Line line(const std::vector<int>& particles) const {
    Line line;
    for (const int i : particles) line.push_back(x_.col(i));
    return line;
  }

  // How far each particle is from these along the cloth, about, over its flat shape, m.
  std::vector<double> distances(const std::vector<int>& from) const {
    std::vector<double> all(beside_.size(), std::numeric_limits<double>::infinity());
    using Reached = std::pair<double, int>;
    std::priority_queue<Reached, std::vector<Reached>, std::greater<>> queue;
    for (const int i : from) all[static_cast<std::size_t>(i)] = 0, queue.push({0, i});
    while (!queue.empty()) {
      const auto [far, i] = queue.top();
      queue.pop();
      if (far > all[static_cast<std::size_t>(i)]) continue;
      for (const auto& [length, j] : beside_[static_cast<std::size_t>(i)])
        if (double& known = all[static_cast<std::size_t>(j)]; far + length < known)
          known = far + length, queue.push({known, j});
    }
    return all;
  }

  // The lines along which cloth is so far away; none where one of them does not close.
  std::vector<Line> lines_at(double level, const std::vector<double>& distances) const {
    const auto far = [&](int i) { return distances[static_cast<std::size_t>(i)] - level; };
    std::map<Edge, std::vector<Edge>> next;
    for (const auto& triangle : mesh_.triangles) {
      std::vector<Edge> crossed;
      for (std::size_t k = 0; k < 3; ++k) {
        const int i = triangle[k], j = triangle[(k + 1) % 3];
        if ((far(i) < 0) != (far(j) < 0)) crossed.push_back(edge_of(i, j));
      }
      if (crossed.size() != 2) continue;
      next[crossed[0]].push_back(crossed[1]);
      next[crossed[1]].push_back(crossed[0]);
    }
    std::vector<Line> lines;
    while (!next.empty()) {
      Line& line = lines.emplace_back();
      Edge at = next.begin()->first, before = at;
      for (auto way = next.find(at); way != next.end(); way = next.find(at)) {
        const std::vector<Edge>& ways = way->second;
        if (ways.size() != 2) return {};
        const double share = far(at.first) / (far(at.first) - far(at.second));
        line.push_back(x_.col(at.first) + share * (x_.col(at.second) - x_.col(at.first)));
        const Edge to = ways[ways[0] == before ? 1 : 0];
        before = at;
        at = to;
        next.erase(way);
      }
    }
    return lines;
  }

 private:
  const TriangleMesh& mesh_;
  const Matrix3Xd& x_;
  std::vector<std::vector<std::pair<double, int>>> beside_;  // flat length and particle
  std::map<int, std::vector<int>> next_;                     // along borders
};

// The panel with most of a border.
std::string panel_of(const TriangleMesh& mesh, std::vector<int> border) {
  std::ranges::sort(border);
  std::string name;
  std::ptrdiff_t most = 0;
  auto triangle = mesh.triangles.begin();
  for (const Panel& panel : mesh.panels) {
    std::ptrdiff_t count = 0;
    for (const auto end = triangle + panel.triangles; triangle != end; ++triangle)
      count += std::ranges::count_if(*triangle,
                                     [&](int i) { return std::ranges::binary_search(border, i); });
    if (count > most) most = count, name = panel.name;
  }
  return name;
}

}  // namespace

std::vector<LooseBorder> loose_borders(const Scene& scene, const MovingBodies& bodies,
                                       const SheetDefinition& sheet, const Matrix3Xd& x,
                                       double time) {
  const TriangleMesh& mesh = triangles_in(sheet);
  const auto distance = [&](const Vector3d& at) {
    return distance_from_any(scene, bodies, at, time);
  };
  const auto outside = [&](const Vector3d& at) -> Vector3d {
    const Distance from = distance(at);
    return at + std::max(0.0, -from.value) * from.normal;
  };
  const auto depth = [&](const Vector3d& at) { return -distance(at).value; };
  const auto is_around = [&](const Line& line) {
    return is_stuck(line, outside) || holds_part(line, depth);
  };
  const SewnCloth cloth(mesh, x);
  const auto borders = cloth.borders();
  std::vector<LooseBorder> loose;
  for (const std::vector<int>& border : borders) {
    const Line line = cloth.line(border);
    const double length = length_of(line);
    const std::vector<double> distances = cloth.distances(border);
    // one of several of a piece of cloth
    if (std::ranges::none_of(borders, [&](const std::vector<int>& other) {
          const double far = distances[static_cast<std::size_t>(other.front())];
          return far > 0 && std::isfinite(far);
        }))
      continue;
    if (length < kHole) {
      const std::vector<Line> inwards = cloth.lines_at(kTube, distances);
      if (inwards.size() != 1 || length_of(inwards[0]) > length + std::numbers::pi * kTube)
        continue;
    }
    bool around = is_around(line);
    // as far as a line along the border is one of the same sleeve, leg or hood
    for (double level = kStep; level < length / 2 && !around; level += kStep) {
      const std::vector<Line> inwards = cloth.lines_at(level, distances);
      if (inwards.empty()) break;
      around = std::ranges::any_of(inwards, [&](const Line& each) {
        return length_of(each) < 2 * length && is_around(each);
      });
    }
    if (!around) loose.push_back({length, panel_of(mesh, border)});
  }
  return loose;
}

}  // namespace weft

#include "core/around_bodies.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

#include "core/frame_values.h"
#include "core/triangles/geodesics.h"
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

Line line_through(const std::vector<int>& particles, const Matrix3Xd& x) {
  Line line;
  for (const int i : particles) line.push_back(x.col(i));
  return line;
}

// How far each particle is from these along the cloth, over its flat shape, m.
std::vector<double> distances_from(const std::vector<int>& particles, const RestShape& shape) {
  const auto count = static_cast<std::size_t>(shape.particles);
  Tethers ways{{particles, std::vector<int>(count),
                std::vector<double>(count, std::numeric_limits<double>::infinity())}};
  measure_tethers(shape, ways);
  return std::move(ways.front().length);
}

// The lines along which cloth is so far away; none where one of them does not close.
std::vector<Line> lines_at(double level, const std::vector<double>& distances,
                           const TriangleMesh& mesh, const Matrix3Xd& x) {
  const auto far = [&](int i) { return distances[static_cast<std::size_t>(i)] - level; };
  std::map<Edge, std::vector<Edge>> next;
  for (const auto& triangle : mesh.triangles) {
    std::vector<Edge> crossed;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [i, j] = std::minmax(triangle[k], triangle[(k + 1) % 3]);
      if ((far(i) < 0) != (far(j) < 0)) crossed.emplace_back(i, j);
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
      line.push_back(x.col(at.first) + share * (x.col(at.second) - x.col(at.first)));
      const Edge to = ways[ways[0] == before ? 1 : 0];
      before = at;
      at = to;
      next.erase(way);
    }
  }
  return lines;
}

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
  const RestShape shape = rest_shape(mesh);
  const auto borders = borders_of(mesh);
  std::vector<LooseBorder> loose;
  for (const std::vector<int>& border : borders) {
    const Line line = line_through(border, x);
    const double length = length_of(line);
    const std::vector<double> distances = distances_from(border, shape);
    // one of several of a piece of cloth
    if (std::ranges::none_of(borders, [&](const std::vector<int>& other) {
          const double far = distances[static_cast<std::size_t>(other.front())];
          return far > 0 && std::isfinite(far);
        }))
      continue;
    if (length < kHole) {
      const std::vector<Line> inwards = lines_at(kTube, distances, mesh, x);
      if (inwards.size() != 1 || length_of(inwards[0]) > length + std::numbers::pi * kTube)
        continue;
    }
    bool around = is_around(line);
    // as far as a line along the border is one of the same sleeve, leg or hood
    for (double level = kStep; level < length / 2 && !around; level += kStep) {
      const std::vector<Line> inwards = lines_at(level, distances, mesh, x);
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

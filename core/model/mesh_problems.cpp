#include "core/model/mesh_problems.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "core/model/text.h"

namespace weft {
namespace {

constexpr std::size_t kMostParticles = std::size_t{4096} * 4096;
constexpr int kMostAtParticle = 200;               // bending around it costs the square
constexpr double kFar = 1e4, kLeastHeight = 1e-6;  // m

class MeshCheck {
 public:
  MeshCheck(const TriangleMesh& mesh, const std::string& field, std::size_t most)
      : mesh_(mesh), field_(field), most_(most) {}

  std::vector<Problem> run() {
    check_points("positions_m", mesh_.start);
    check_points("flat_m", mesh_.flat);
    check_panels();
    const bool sound = check_indices();
    if (!sound || !problems_.empty()) return std::move(problems_);
    check_flat();
    check_edges();
    check_used();
    if (!mesh_.folds.empty()) check_folds();
    return std::move(problems_);
  }

 private:
  template <class... Parts>
  void problem(const std::string& name, const Parts&... message) {
    if (problems_.size() < most_) problems_.push_back({field_ + "." + name, join(message...)});
  }

  template <class Point>
  void check_points(const std::string& name, const std::vector<Point>& points) {
    if (points.size() < 3 || points.size() > kMostParticles)
      problem(name, "has ", points.size(), " points; 3 to ", kMostParticles, " are needed");
    for (std::size_t i = 0; i < points.size(); ++i)
      for (const double value : points[i])
        if (!(value >= -kFar && value <= kFar))
          problem(name, "point ", i, " has a coordinate of ", value, " m, not within ", -kFar,
                  " to ", kFar, " m");
  }

  void check_panels() {
    constexpr double kMostGrain = 7;
    std::size_t triangles = 0;
    std::set<std::string> names;
    for (std::size_t p = 0; p < mesh_.panels.size(); ++p) {
      const Panel& panel = mesh_.panels[p];
      const std::string at = join("panels[", p, "]");
      if (panel.triangles < 1)
        problem(at + ".triangle_count", panel.triangles, " is not 1 or more");
      if (!(std::abs(panel.grain) <= kMostGrain))
        problem(at + ".grain_rad", panel.grain, " rad is not within ", -kMostGrain, " to ",
                kMostGrain, " rad");
      triangles += static_cast<std::size_t>(std::max(panel.triangles, 0));
      const std::string& name = panel.name;
      if (name.empty() || name.size() > 63 ||
          name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_-") != std::string::npos)
        problem(at + ".name", "\"", name.substr(0, 80),
                "\" is not 1 to 63 characters of a-z, 0-9, - and _");
      else if (!names.insert(name).second)
        problem(at + ".name", "\"", name, "\" is taken");
    }
    if (triangles != mesh_.triangles.size())
      problem("panels", "have ", triangles, " triangles; the mesh has ", mesh_.triangles.size());
  }

  bool check_indices() {
    if (mesh_.triangles.empty()) {
      problem("triangles", "is empty; a sheet has 1 triangle or more");
      return false;
    }
    bool sound = check_indices("triangles", mesh_.triangles, mesh_.start.size());
    if (mesh_.flat_triangles.empty()) {
      if (mesh_.flat.size() == mesh_.start.size()) return sound;
      problem("flat_m", "has ", mesh_.flat.size(), " corners for ", mesh_.start.size(),
              " particles; without flat_triangles there is one for each");
      return false;
    }
    if (mesh_.flat_triangles.size() != mesh_.triangles.size()) {
      problem("flat_triangles", "has ", mesh_.flat_triangles.size(), " triangles; the mesh has ",
              mesh_.triangles.size());
      return false;
    }
    return check_indices("flat_triangles", mesh_.flat_triangles, mesh_.flat.size()) && sound;
  }

  bool check_indices(const std::string& name, const std::vector<std::array<int, 3>>& triangles,
                     std::size_t points) {
    bool sound = true;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const auto& [a, b, c] = triangles[t];
      for (const int i : triangles[t])
        if (i < 0 || static_cast<std::size_t>(i) >= points) {
          problem(name, "triangle ", t, " has a corner of index ", static_cast<unsigned>(i),
                  "; there are ", points);
          sound = false;
        }
      if (a == b || b == c || c == a) {
        problem(name, "triangle ", t, " has twice the corner ", a == b ? a : c);
        sound = false;
      }
    }
    return sound;
  }

  void check_flat() {
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      double longest = 0;
      for (std::size_t k = 0; k < 3; ++k)
        longest = std::max(longest,
                           (flat_corner(mesh_, t, (k + 1) % 3) - flat_corner(mesh_, t, k)).norm());
      const Vector2d a = flat_corner(mesh_, t, 1) - flat_corner(mesh_, t, 0);
      const Vector2d b = flat_corner(mesh_, t, 2) - flat_corner(mesh_, t, 0);
      const double height = (a.x() * b.y() - a.y() * b.x()) / std::max(longest, 1e-30);
      if (height < -kLeastHeight)
        problem(
            "flat_m", "triangle ", t,
            " runs clockwise in the flat shape; all run anticlockwise, where a panel is mirrored "
            "mirror its flat shape");
      else if (height < kLeastHeight)
        problem("flat_m", "triangle ", t, " has a height of ", height, " m in the flat shape; ",
                kLeastHeight, " m or more are needed");
    }
  }

  // Every edge belongs to one triangle, or to two that run along it in opposite directions.
  void check_edges() {
    struct Side {
      int low, high, triangle;
      bool rises;
    };
    std::vector<Side> sides;
    sides.reserve(3 * mesh_.triangles.size());
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const int i = mesh_.triangles[t][k], j = mesh_.triangles[t][(k + 1) % 3];
        sides.push_back({std::min(i, j), std::max(i, j), static_cast<int>(t), i < j});
      }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
      return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
    });
    for (std::size_t first = 0, last = 0; first < sides.size(); first = last) {
      const Side& one = sides[first];
      while (last < sides.size() && sides[last].low == one.low && sides[last].high == one.high)
        ++last;
      if (last - first > 2)
        problem("triangles", "the edge between particles ", one.low, " and ", one.high, " has ",
                last - first, " triangles, among them ", one.triangle, " and ",
                sides[first + 1].triangle, "; at most 2 meet in an edge");
      else if (last - first == 2 && one.rises == sides[first + 1].rises)
        problem("triangles", "triangles ", one.triangle, " and ", sides[first + 1].triangle,
                " run along their edge between particles ", one.low, " and ", one.high,
                " in the same direction: one of them is turned over");
    }
  }

  void check_used() {
    std::vector<int> triangles(mesh_.start.size());
    for (const auto& triangle : mesh_.triangles)
      for (const int i : triangle) ++triangles[static_cast<std::size_t>(i)];
    for (std::size_t i = 0; i < triangles.size(); ++i)
      if (triangles[i] == 0)
        problem("positions_m", "particle ", i, " is in no triangle");
      else if (triangles[i] > kMostAtParticle)
        problem("triangles", "particle ", i, " is a corner of ", triangles[i], " triangles; ",
                kMostAtParticle, " at most meet in one");
  }

  void check_folds() {
    std::map<std::pair<int, int>, int> triangles;  // at each edge
    for (const auto& triangle : mesh_.triangles)
      for (std::size_t k = 0; k < 3; ++k)
        ++triangles[std::minmax(triangle[k], triangle[(k + 1) % 3])];
    std::map<std::pair<int, int>, std::size_t> taken;
    for (std::size_t f = 0; f < mesh_.folds.size(); ++f) {
      const auto& [particles, angle] = mesh_.folds[f];
      const std::string at = join("folds[", f, "]");
      if (!(std::abs(angle) <= kMostFold))
        problem(at + ".angle_rad", angle, " rad is not within ", -kMostFold, " to ", kMostFold,
                " rad");
      if (particles.size() < 2)
        problem(at + ".particles", "has ", particles.size(), " particles; a line has 2 or more");
      for (std::size_t k = 0; k + 1 < particles.size(); ++k) {
        const std::pair<int, int> edge = std::minmax(particles[k], particles[k + 1]);
        const auto found = triangles.find(edge);
        const int count = found == triangles.end() ? 0 : found->second;
        if (count != 2)
          problem(at + ".particles", particles[k], " and ", particles[k + 1],
                  count == 0
                      ? " are not the ends of an edge"
                      : " are the ends of an edge of one triangle; there is nothing to fold");
        else if (const auto [other, added] = taken.emplace(edge, f); !added)
          problem(at + ".particles", "the edge of ", particles[k], " and ", particles[k + 1],
                  " is folded already, by folds[", other->second, "]");
      }
    }
  }

  const TriangleMesh& mesh_;
  const std::string& field_;
  std::size_t most_;
  std::vector<Problem> problems_;
};

}  // namespace

std::vector<Problem> find_problems(const TriangleMesh& mesh, const std::string& field,
                                   std::size_t most) {
  return MeshCheck(mesh, field, most).run();
}

}  // namespace weft

#include <algorithm>
#include <cmath>
#include <optional>

#include "client/imports/edges.h"
#include "client/imports/flat_shape.h"
#include "client/imports/mend.h"

namespace weft::client {
namespace {

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// A particle that goes where another is.
struct Move {
  int from, to;
  double way;  // in the flat shape
};

// Triangles around particles, kept as they are joined.
class Joining {
 public:
  // Longer ways change the mesh more than they mend.
  Joining(ImportedMesh& mesh, double longest)
      : mesh_(mesh),
        longest_(longest),
        around_(mesh.positions.size()),
        fixed_(mesh.positions.size(), false),
        alive_(mesh.triangles.size(), true) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (const int i : mesh.triangles[t]) around_[as_index(i)].push_back(static_cast<int>(t));
    fix_borders_and_seams();
  }

  // Joins along an edge of the triangle, the shortest that may be.
  std::optional<Move> collapse(int triangle) {
    std::vector<Move> moves;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& particles = mesh_.triangles[as_index(triangle)];
      const FlatCorners corners = flat_corners(mesh_, as_index(triangle));
      const double way = (corners[(k + 1) % 3] - corners[k]).norm();
      moves.push_back({particles[k], particles[(k + 1) % 3], way});
      moves.push_back({particles[(k + 1) % 3], particles[k], way});
    }
    std::stable_sort(moves.begin(), moves.end(),
                     [](const Move& a, const Move& b) { return a.way < b.way; });
    const double height = least_height(mesh_, as_index(triangle));
    for (const Move& move : moves) {
      const auto corner = corner_of(triangle, move.to);
      if (!may(move, corner, height)) continue;
      apply(move, corner);
      return move;
    }
    return std::nullopt;
  }

  const std::vector<bool>& alive() const { return alive_; }

 private:
  // What lies on a border, a seam or between panels stays.
  void fix_borders_and_seams() {
    for_each_edge(sides_of(mesh_.triangles), [&](std::span<const Side> sides) {
      const int a = sides[0].triangle, b = sides.back().triangle;
      const bool inner = sides.size() == 2 &&
                         mesh_.panel[as_index(a)] == mesh_.panel[as_index(b)] &&
                         corner_of(a, sides[0].low) == corner_of(b, sides[0].low) &&
                         corner_of(a, sides[0].high) == corner_of(b, sides[0].high);
      if (!inner) fixed_[as_index(sides[0].low)] = fixed_[as_index(sides[0].high)] = true;
    });
  }

  bool has(int triangle, int particle) const {
    return std::ranges::find(mesh_.triangles[as_index(triangle)], particle) !=
           mesh_.triangles[as_index(triangle)].end();
  }

  int corner_of(int triangle, int particle) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (mesh_.triangles[as_index(triangle)][k] == particle)
        return mesh_.corners[as_index(triangle)][k];
    return kNoCorner;
  }

  std::vector<int> ring(int particle) const {
    std::vector<int> result;
    for (const int t : around_[as_index(particle)])
      for (const int i : mesh_.triangles[as_index(t)])
        if (i != particle) result.push_back(i);
    std::sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    return result;
  }

  // Neighbours that both have: two where a surface stays one.
  bool share_two(int a, int b) const {
    const std::vector<int> of_a = ring(a), of_b = ring(b);
    std::vector<int> both;
    std::set_intersection(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(),
                          std::back_inserter(both));
    return both.size() == 2;
  }

  bool may(const Move& move, int corner, double height) const {
    if (move.way > longest_ || fixed_[as_index(move.from)] || !share_two(move.from, move.to))
      return false;
    for (const int t : around_[as_index(move.from)]) {
      if (has(t, move.to)) {
        if (corner_of(t, move.to) != corner) return false;
        continue;
      }
      FlatCorners corners = flat_corners(mesh_, as_index(t));
      for (std::size_t k = 0; k < 3; ++k)
        if (mesh_.triangles[as_index(t)][k] == move.from) corners[k] = mesh_.flat[as_index(corner)];
      if (signed_area(corners) <= 0 || least_height(corners) <= height) return false;
    }
    return true;
  }

  void apply(const Move& move, int corner) {
    for (const int t : around_[as_index(move.from)]) {
      if (has(t, move.to)) {
        alive_[as_index(t)] = false;
        for (const int i : mesh_.triangles[as_index(t)])
          if (i != move.from) std::erase(around_[as_index(i)], t);
        continue;
      }
      for (std::size_t k = 0; k < 3; ++k) {
        if (mesh_.triangles[as_index(t)][k] != move.from) continue;
        mesh_.triangles[as_index(t)][k] = move.to;
        mesh_.corners[as_index(t)][k] = corner;
      }
      around_[as_index(move.to)].push_back(t);
    }
    around_[as_index(move.from)].clear();
  }

  ImportedMesh& mesh_;
  double longest_;
  std::vector<std::vector<int>> around_;
  std::vector<bool> fixed_, alive_;
};

// Low triangles, the lowest first.
std::vector<int> low_triangles(const ImportedMesh& mesh, const std::vector<bool>& alive,
                               double height) {
  std::vector<std::pair<double, int>> low;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (const double own = alive[t] ? least_height(mesh, t) : height; own < height)
      low.emplace_back(own, static_cast<int>(t));
  std::sort(low.begin(), low.end());
  std::vector<int> result;
  for (const auto& [own, t] : low) result.push_back(t);
  return result;
}

double flat_area(const ImportedMesh& mesh) {
  double area = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    area += signed_area(flat_corners(mesh, t));
  return area;
}

}  // namespace

Collapse collapse_slivers(ImportedMesh& mesh, double part) {
  constexpr int kPasses = 8;
  std::vector<double> heights;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) heights.push_back(least_height(mesh, t));
  Collapse result{.height = part * median(std::move(heights))};
  const double area = flat_area(mesh);
  Joining joining(mesh, 2 * result.height);
  bool moved = true;
  for (int pass = 0; pass < kPasses && moved; ++pass) {
    moved = false;
    for (const int t : low_triangles(mesh, joining.alive(), result.height)) {
      if (!joining.alive()[as_index(t)] || least_height(mesh, as_index(t)) >= result.height)
        continue;
      const std::optional<Move> move = joining.collapse(t);
      if (!move) continue;
      moved = true;
      ++result.particles;
      result.longest = std::max(result.longest, move->way);
    }
  }
  result.left = static_cast<int>(low_triangles(mesh, joining.alive(), result.height).size());
  keep_triangles(mesh, joining.alive());
  result.area_change = area > 0 ? flat_area(mesh) / area - 1 : 0;
  return result;
}

}  // namespace weft::client

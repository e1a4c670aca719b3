#include "client/imports/mend.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "client/imports/edges.h"
#include "client/imports/flat_shape.h"
#include "client/imports/mesh_check.h"

namespace weft::client {
namespace {

// Particles by the cube of space that they lie in.
class Cubes {
 public:
  explicit Cubes(double edge) : edge_(edge) {}

  // The first within the tolerance, or -1.
  int find(const std::vector<Vector3d>& positions, const Vector3d& position,
           double tolerance) const {
    const double reach = edge_ == 0 ? 0 : 1;
    int found = -1;
    for (double x = -reach; x <= reach; ++x)
      for (double y = -reach; y <= reach; ++y)
        for (double z = -reach; z <= reach; ++z) {
          const auto cube = cubes_.find(key(position + edge_ * Vector3d(x, y, z)));
          if (cube == cubes_.end()) continue;
          for (const int i : cube->second)
            if ((positions[as_index(i)] - position).norm() <= tolerance && (found < 0 || i < found))
              found = i;
        }
    return found;
  }
  void add(const Vector3d& position, int i) { cubes_[key(position)].push_back(i); }

 private:
  // Different cubes may share one: distances decide.
  std::uint64_t key(const Vector3d& position) const {
    std::uint64_t hash = 0;
    for (const double x : position) {
      const double cell = edge_ == 0 ? x + 0.0 : std::floor(x / edge_);  // -0 is 0
      hash = (hash ^ std::hash<double>()(cell)) * 0x9E3779B97F4A7C15u;
      hash ^= hash >> 29;
    }
    return hash;
  }

  double edge_;
  std::unordered_map<std::uint64_t, std::vector<int>> cubes_;
};

bool is_empty_flat(const ImportedMesh& mesh, std::size_t t) {
  const auto& corners = mesh.corners[t];
  if (std::ranges::find(corners, kNoCorner) != corners.end()) return false;
  const FlatCorners flat = flat_corners(mesh, t);
  return is_empty({Vector3d(flat[0].x(), flat[0].y(), 0), Vector3d(flat[1].x(), flat[1].y(), 0),
                   Vector3d(flat[2].x(), flat[2].y(), 0)});
}

int keep_only(ImportedMesh& mesh, const std::vector<bool>& kept) {
  keep_triangles(mesh, kept);
  return static_cast<int>(std::count(kept.begin(), kept.end(), false));
}

// A neighbour over an edge that two triangles have.
struct Neighbour {
  int triangle;
  bool opposite;  // faces the other way
};

std::vector<std::vector<Neighbour>> neighbours_of(const ImportedMesh& mesh) {
  std::vector<std::vector<Neighbour>> neighbours(mesh.triangles.size());
  for_each_edge(sides_of(mesh.triangles), [&](std::span<const Side> sides) {
    if (sides.size() != 2 || sides[0].triangle == sides[1].triangle) return;
    const bool opposite = sides[0].ascending == sides[1].ascending;
    neighbours[as_index(sides[0].triangle)].push_back({sides[1].triangle, opposite});
    neighbours[as_index(sides[1].triangle)].push_back({sides[0].triangle, opposite});
  });
  return neighbours;
}

constexpr int kUnknown = -1;

// Triangles of the piece around the first, each marked 1 where it faces otherwise than that one.
// Empty where they disagree.
std::vector<std::size_t> mark_piece(const std::vector<std::vector<Neighbour>>& neighbours,
                                    std::size_t first, std::vector<int>& turned) {
  std::vector<std::size_t> piece{first};
  bool agrees = true;
  turned[first] = 0;
  for (std::size_t next = 0; next < piece.size(); ++next) {
    const std::size_t t = piece[next];
    for (const Neighbour& each : neighbours[t]) {
      int& other = turned[as_index(each.triangle)];
      const int wanted = each.opposite ? 1 - turned[t] : turned[t];
      agrees = agrees && (other == kUnknown || other == wanted);
      if (other != kUnknown) continue;
      other = wanted;
      piece.push_back(as_index(each.triangle));
    }
  }
  if (!agrees) piece.clear();
  return piece;
}

}  // namespace

int join_points(ImportedMesh& mesh, double tolerance) {
  Cubes cubes(tolerance);
  std::vector<int> now(mesh.positions.size());
  int joined = 0;
  for (std::size_t i = 0; i < now.size(); ++i) {
    now[i] = cubes.find(mesh.positions, mesh.positions[i], tolerance);
    if (now[i] >= 0) {
      ++joined;
      continue;
    }
    now[i] = static_cast<int>(i);
    cubes.add(mesh.positions[i], now[i]);
  }
  for (auto& triangle : mesh.triangles)
    for (int& i : triangle) i = now[as_index(i)];
  return joined;
}

int drop_repeated_triangles(ImportedMesh& mesh) {
  std::vector<bool> kept = find_repeated(mesh);
  kept.flip();
  for (std::size_t t = 0; t < kept.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    if (a == b || b == c || c == a) kept[t] = false;
  }
  return keep_only(mesh, kept);
}

int drop_empty_triangles(ImportedMesh& mesh) {
  std::vector<bool> kept(mesh.triangles.size());
  for (std::size_t t = 0; t < kept.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const auto at = [&](int i) { return mesh.positions[as_index(i)]; };
    kept[t] = !is_empty({at(a), at(b), at(c)}) && !is_empty_flat(mesh, t);
  }
  return keep_only(mesh, kept);
}

int turn_triangles(ImportedMesh& mesh) {
  const auto neighbours = neighbours_of(mesh);
  std::vector<int> turned(mesh.triangles.size(), kUnknown);
  int count = 0;
  for (std::size_t first = 0; first < turned.size(); ++first) {
    if (turned[first] != kUnknown) continue;
    const std::vector<std::size_t> piece = mark_piece(neighbours, first, turned);
    const auto marked = std::ranges::count_if(piece, [&](std::size_t t) { return turned[t] == 1; });
    const int fewer = 2 * static_cast<std::size_t>(marked) <= piece.size() ? 1 : 0;
    for (const std::size_t t : piece) {
      if (turned[t] != fewer) continue;
      std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
      std::swap(mesh.corners[t][1], mesh.corners[t][2]);
      ++count;
    }
  }
  return count;
}

}  // namespace weft::client

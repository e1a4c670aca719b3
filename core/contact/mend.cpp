#include "core/contact/mend.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/model/text.h"

namespace weft {
namespace {

constexpr std::size_t kMostProblems = 100;
constexpr std::size_t kMostVertices = 1'000'000, kMostTriangles = 2'000'000;
constexpr double kMostDistance = 1e4;  // m

class Mender {
 public:
  Mender(BodyMesh mesh, const std::string& field) : field_(field) {
    mended_.mesh = std::move(mesh);
    mended_.source.resize(mended_.mesh.triangles.size());
    std::iota(mended_.source.begin(), mended_.source.end(), 0);
  }

  MendedMesh run() && {
    if (is_sound()) {
      join_vertices();
      if (join_triangles()) face_outward();
    }
    return std::move(mended_);
  }

 private:
  // A side of a triangle: from `low` to `high` where it rises.
  struct Side {
    int low, high, triangle;
    bool rises;
  };

  template <class... Parts>
  void problem(const char* name, const Parts&... message) {
    if (mended_.problems.size() < kMostProblems)
      mended_.problems.push_back({field_ + "." + name, join(message...)});
  }
  int source(int triangle) const { return mended_.source[static_cast<std::size_t>(triangle)]; }
  const Vector3d& vertex(int i) const { return mended_.mesh.vertices[static_cast<std::size_t>(i)]; }

  bool is_sound() {
    const auto& [vertices, triangles] = mended_.mesh;
    if (vertices.size() < 4 || vertices.size() > kMostVertices)
      problem("positions_m", "has ", vertices.size(), " vertices; 4 to ", kMostVertices,
              " are needed");
    if (triangles.size() < 4 || triangles.size() > kMostTriangles)
      problem("triangles", "has ", triangles.size(), " triangles; 4 to ", kMostTriangles,
              " are needed");
    for (std::size_t i = 0; i < vertices.size(); ++i)
      if (!(vertices[i].array().abs() <= kMostDistance).all())  // nor where one is no number
        problem("positions_m", "vertex ", i, " does not lie within ", kMostDistance,
                " m of the origin along each axis");
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (const int i : triangles[t])
        if (i < 0 || static_cast<std::size_t>(i) >= vertices.size())
          problem("triangles", "triangle ", t, " has a corner of index ", static_cast<unsigned>(i),
                  "; there are ", vertices.size());
    return mended_.problems.empty();
  }

  // Files split vertices where their texture does.
  void join_vertices() {
    auto& [vertices, triangles] = mended_.mesh;
    std::vector<int> order(vertices.size()), same(vertices.size());
    std::iota(order.begin(), order.end(), 0);
    const auto place = [&](int i) {
      const Vector3d& at = vertex(i);
      return std::tuple(at.x(), at.y(), at.z());
    };
    std::sort(order.begin(), order.end(),
              [&](int a, int b) { return std::tuple(place(a), a) < std::tuple(place(b), b); });
    std::size_t doubled = 0;
    for (std::size_t k = 0; k < order.size(); ++k) {
      const auto i = static_cast<std::size_t>(order[k]);
      const bool again = k > 0 && place(order[k]) == place(order[k - 1]);
      same[i] = again ? same[static_cast<std::size_t>(order[k - 1])] : order[k];
      doubled += again ? 1 : 0;
    }
    std::size_t left = 0;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      auto corners = triangles[t];
      for (int& i : corners) i = same[static_cast<std::size_t>(i)];
      const auto [a, b, c] = corners;
      if (a == b || b == c || c == a) continue;
      triangles[left] = corners;
      mended_.source[left++] = mended_.source[t];
    }
    if (doubled > 0)
      mended_.notes.push_back(join(doubled, " vertices lie where another one does: they are one"));
    if (left < triangles.size())
      mended_.notes.push_back(join(triangles.size() - left,
                                   " triangles have twice the same corner: they are left out"));
    triangles.resize(left);
    mended_.source.resize(left);
  }

  // Finds the neighbours of each triangle; false: not every edge has two.
  bool join_triangles() {
    const auto& triangles = mended_.mesh.triangles;
    std::vector<Side> sides;
    sides.reserve(3 * triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const int i = triangles[t][k], j = triangles[t][(k + 1) % 3];
        sides.push_back({std::min(i, j), std::max(i, j), static_cast<int>(t), i < j});
      }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
      return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
    });
    neighbours_.resize(triangles.size());
    for (std::size_t first = 0, last = 0; first < sides.size(); first = last) {
      const Side& one = sides[first];
      while (last < sides.size() && sides[last].low == one.low && sides[last].high == one.high)
        ++last;
      if (last - first == 1) {
        problem("triangles", "triangle ", source(one.triangle),
                " has no neighbour at its edge between vertices ", one.low, " and ", one.high,
                ": the surface is open there");
      } else if (last - first > 2) {
        problem("triangles", "the edge between vertices ", one.low, " and ", one.high, " has ",
                last - first, " triangles, among them ", source(one.triangle), " and ",
                source(sides[first + 1].triangle), "; 2 meet in each edge of a body");
      } else {
        const Side& other = sides[first + 1];
        const bool turned = one.rises == other.rises;
        neighbours_[static_cast<std::size_t>(one.triangle)].push_back({other.triangle, turned});
        neighbours_[static_cast<std::size_t>(other.triangle)].push_back({one.triangle, turned});
      }
    }
    return mended_.problems.empty();
  }

  // Each piece by itself.
  void face_outward() {
    auto& triangles = mended_.mesh.triangles;
    std::vector<int> facing(triangles.size());  // 1: as its piece's first triangle, -1: against it
    std::size_t turned = 0;
    int first_turned = -1;
    for (std::size_t start = 0; start < triangles.size(); ++start) {
      if (facing[start] != 0) continue;
      facing[start] = 1;
      std::vector<int> piece{static_cast<int>(start)};
      double volume = 0;
      for (std::size_t n = 0; n < piece.size(); ++n) {
        const auto t = static_cast<std::size_t>(piece[n]);
        for (const Neighbour& each : neighbours_[t]) {
          int& other = facing[static_cast<std::size_t>(each.triangle)];
          const int wanted = each.turned ? -facing[t] : facing[t];
          if (other == 0) {
            other = wanted;
            piece.push_back(each.triangle);
          } else if (other != wanted) {
            return problem("triangles", "triangles ", source(piece[n]), " and ",
                           source(each.triangle),
                           " face opposite sides, however their piece is turned: it has one side, "
                           "as a Möbius strip has");
          }
        }
        const auto [a, b, c] = triangles[t];
        const Vector3d& from = vertex(triangles[start][0]);
        volume +=
            facing[t] * (vertex(a) - from).dot((vertex(b) - from).cross(vertex(c) - from)) / 6;
      }
      if (volume == 0)
        problem("triangles", "the piece that triangle ", source(piece[0]),
                " belongs to encloses nothing");
      for (const int t : piece) {
        const auto i = static_cast<std::size_t>(t);
        if (facing[i] * volume >= 0) continue;
        std::swap(triangles[i][1], triangles[i][2]);
        if (turned++ == 0) first_turned = source(t);
      }
    }
    if (turned > 0)
      mended_.notes.push_back(join(turned, " triangles face inward, the first of them ",
                                   first_turned, ": they are turned over"));
  }

  struct Neighbour {
    int triangle;
    bool turned;  // runs along the edge in the same direction
  };
  const std::string& field_;
  MendedMesh mended_;
  std::vector<std::vector<Neighbour>> neighbours_;
};

}  // namespace

MendedMesh mend(BodyMesh mesh, const std::string& field) {
  return Mender(std::move(mesh), field).run();
}

}  // namespace weft

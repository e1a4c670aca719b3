#include "server/convert/mesh.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <set>

#include "core/model/text.h"

namespace weft {
namespace {

static_assert(std::endian::native == std::endian::little);

using Triangle = std::array<std::uint32_t, 3>;

template <class Value>
std::vector<Value> values_of(const std::string& bytes) {
  std::vector<Value> values(bytes.size() / sizeof(Value));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(Value));
  return values;
}

// Corners of the flat shape, or 0 where it has none of its own.
std::size_t corners_of(const v1::MeshData& mesh) { return mesh.flat_m().size() / 8; }

// Collects what is wrong with the arrays of a mesh.
class Check {
 public:
  Check(const v1::MeshData& mesh, const std::string& field) : mesh_(mesh), field_(field) {
    const auto particles = static_cast<std::size_t>(particles_of(mesh));
    plane(mesh.positions_m(), "positions_m", 12);
    plane(mesh.flat_m(), "flat_m", 8);
    if (mesh.positions_m().empty() && mesh.flat_m().empty())
      problem("positions_m", "is absent, and so is flat_m; give one or both");
    indices(mesh.triangles(), "triangles", particles, "particles");
    if (!mesh.flat_triangles().empty()) {
      indices(mesh.flat_triangles(), "flat_triangles", corners_of(mesh),
              "corners of the flat shape");
      if (mesh.flat_triangles().size() != mesh.triangles().size())
        problem("flat_triangles",
                join("has ", mesh.flat_triangles().size(), " bytes; as many as triangles, ",
                     mesh.triangles().size(), ", or none are needed"));
    } else if (!mesh.flat_m().empty() && corners_of(mesh) != particles) {
      problem("flat_m", join("has ", corners_of(mesh), " corners for ", particles,
                             " particles; give flat_triangles, or as many"));
    }
    panels();
  }

  std::vector<Problem> problems;

 private:
  void problem(const std::string& part, const std::string& message) {
    problems.push_back({field_ + "." + part, message});
  }

  // Values in planes of float32, so many bytes for each point.
  void plane(const std::string& bytes, const char* part, std::size_t size) {
    constexpr float kMost = 1e4F;  // m
    if (bytes.size() % size != 0)
      return problem(part, join("has ", bytes.size(), " bytes, no multiple of ", size));
    const auto values = values_of<float>(bytes);
    const auto bad = std::find_if(values.begin(), values.end(),
                                  [&](float value) { return !(std::abs(value) <= kMost); });
    if (bad != values.end()) {
      const auto points = values.size() * sizeof(float) / size;
      problem(part,
              join(*bad, " m of point ", static_cast<std::size_t>(bad - values.begin()) % points,
                   " is not within -10000 to 10000 m"));
    }
  }

  void indices(const std::string& bytes, const char* part, std::size_t count, const char* what) {
    if (bytes.empty()) return problem(part, "is absent; give one triangle or more");
    if (bytes.size() % sizeof(Triangle) != 0)
      return problem(part, join("has ", bytes.size(), " bytes, no multiple of 12"));
    const auto triangles = values_of<Triangle>(bytes);
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const auto& [a, b, c] = triangles[i];
      const std::uint32_t largest = std::max({a, b, c});
      if (largest >= count)
        return problem(
            part, join("triangle ", i, " names ", largest, ", but there are ", count, " ", what));
      if (a == b || b == c || c == a)
        return problem(part, join("triangle ", i, " has the same corner twice"));
    }
  }

  void panels() {
    const auto triangles = static_cast<std::int64_t>(mesh_.triangles().size() / sizeof(Triangle));
    std::int64_t sum = 0;
    std::set<std::string> names;
    for (int i = 0; i < mesh_.panels_size(); ++i) {
      const v1::Panel& panel = mesh_.panels(i);
      const std::string part = "panels[" + std::to_string(i) + "].";
      const bool named = !panel.name().empty() && panel.name().size() <= 63 &&
                         panel.name().find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_-") ==
                             std::string::npos;
      if (!named)
        problem(part + "name", "\"" + panel.name() + "\" is not 1 to 63 characters of [a-z0-9_-]");
      if (named && !names.insert(panel.name()).second)
        problem(part + "name", "\"" + panel.name() + "\" is another panel's, too");
      if (panel.triangle_count() < 1)
        problem(part + "triangle_count", std::to_string(panel.triangle_count()) + " is below 1");
      if (!(std::abs(panel.grain_rad()) <= 7))
        problem(part + "grain_rad", join(panel.grain_rad(), " rad is not within -7 to 7 rad"));
      sum += panel.triangle_count();
    }
    if (mesh_.panels_size() > 0 && sum != triangles)
      problem("panels", join("have ", sum, " triangles together; the mesh has ", triangles));
  }

  const v1::MeshData& mesh_;
  const std::string field_;
};

struct Edges {
  std::int32_t border = 0, branching = 0;
  bool oriented = true;  // neighbours run along their edge in opposite directions
};

Edges edges_of(const std::vector<Triangle>& triangles) {
  struct Edge {
    std::uint32_t low, high;
    bool forward;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (const Triangle& triangle : triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = triangle[i], b = triangle[(i + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), a < b});
    }
  }
  const auto key = [](const Edge& edge) { return std::pair(edge.low, edge.high); };
  std::sort(edges.begin(), edges.end(),
            [&](const Edge& a, const Edge& b) { return key(a) < key(b); });
  Edges result;
  for (std::size_t first = 0, next; first < edges.size(); first = next) {
    std::size_t forward = 0;
    for (next = first; next < edges.size() && key(edges[next]) == key(edges[first]); ++next)
      forward += edges[next].forward ? 1 : 0;
    const std::size_t count = next - first;
    result.border += count == 1 ? 1 : 0;
    result.branching += count > 2 ? 1 : 0;
    if (count == 2 && forward != 1) result.oriented = false;
  }
  return result;
}

// Of the flat shape, m; where there is none, of the mesh in space.
std::array<std::array<double, 3>, 3> corners(const v1::MeshData& mesh, const Triangle& in_space,
                                             const Triangle& flat) {
  std::array<std::array<double, 3>, 3> points{};
  const bool has_flat = !mesh.flat_m().empty();
  const std::string& bytes = has_flat ? mesh.flat_m() : mesh.positions_m();
  const std::size_t axes = has_flat ? 2 : 3, count = bytes.size() / (4 * axes);
  for (std::size_t corner = 0; corner < 3; ++corner) {
    const std::size_t index = has_flat ? flat[corner] : in_space[corner];
    for (std::size_t axis = 0; axis < axes; ++axis) {
      float value = 0;
      std::memcpy(&value, bytes.data() + sizeof(float) * (axis * count + index), sizeof value);
      points[corner][axis] = static_cast<double>(value);
    }
  }
  return points;
}

}  // namespace

std::vector<Problem> find_problems(const v1::MeshData& mesh, const std::string& field) {
  return std::move(Check(mesh, field).problems);
}

std::int64_t particles_of(const v1::MeshData& mesh) {
  return static_cast<std::int64_t>(mesh.positions_m().empty() ? corners_of(mesh)
                                                              : mesh.positions_m().size() / 12);
}

v1::MeshFacts facts_of(const v1::MeshData& mesh) {
  const auto triangles = values_of<Triangle>(mesh.triangles());
  const auto flat =
      mesh.flat_triangles().empty() ? triangles : values_of<Triangle>(mesh.flat_triangles());
  double area = 0, least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto [a, b, c] = corners(mesh, triangles[i], flat[i]);
    const auto length = [](const auto& p, const auto& q) {
      return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
    };
    const std::array u{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const std::array v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    const double twice =
        std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
    area += twice / 2;
    const double longest = std::max({length(a, b), length(b, c), length(c, a)});
    least = std::min(least, longest > 0 ? twice / longest : 0);
  }
  const Edges edges = edges_of(triangles);
  v1::MeshFacts facts;
  facts.set_particles(static_cast<std::int32_t>(particles_of(mesh)));
  facts.set_triangles(static_cast<std::int32_t>(triangles.size()));
  facts.set_panels(std::max(1, mesh.panels_size()));
  facts.set_flat_area_m2(area);
  facts.set_border_edges(edges.border);
  facts.set_branching_edges(edges.branching);
  facts.set_closed(edges.border == 0 && edges.branching == 0 && edges.oriented);
  facts.set_least_height_m(least);
  return facts;
}

}  // namespace weft

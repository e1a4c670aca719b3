#include "server/convert/mesh.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "core/contact/body.h"
#include "core/contact/mend.h"
#include "core/contact/moving_bodies.h"
#include "core/model/mesh_problems.h"
#include "core/model/text.h"
#include "server/session/baked_bodies.h"
#include "server/session/idle_threads.h"
#include "server/session/memory.h"

namespace weft {
namespace {

static_assert(std::endian::native == std::endian::little);

using Triangle = std::array<std::uint32_t, 3>;

template <class Value>
std::vector<Value> values_of(std::string_view bytes) {
  std::vector<Value> values(bytes.size() / sizeof(Value));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(Value));
  return values;
}

template <class Value>
std::string bytes_of(const std::vector<Value>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value)};
}

// Corners of the flat shape, or 0 where it has none of its own.
std::size_t corners_of(const v1::MeshData& mesh) { return mesh.flat_m().size() / 8; }

// Of a mesh with poses, its first one.
std::string_view positions_of(const v1::MeshData& mesh) {
  const std::string_view poses = mesh.poses().positions_m();
  const auto count = static_cast<std::size_t>(mesh.poses().times_s_size());
  if (count == 0) return mesh.positions_m();
  return poses.substr(0, poses.size() / count);
}

// Points in planes of float32.
template <class Point>
std::vector<Point> points_of(std::string_view bytes) {
  const auto values = values_of<float>(bytes);
  const std::size_t axes = Point::RowsAtCompileTime, count = values.size() / axes;
  std::vector<Point> points(count);
  for (std::size_t axis = 0; axis < axes; ++axis)
    for (std::size_t i = 0; i < count; ++i)
      points[i][static_cast<Eigen::Index>(axis)] = double{values[axis * count + i]};
  return points;
}

template <class Point>
std::string planes_of(const std::vector<Point>& points) {
  std::vector<float> planes;
  for (Eigen::Index axis = 0; axis < Point::RowsAtCompileTime; ++axis)
    for (const Point& point : points) planes.push_back(static_cast<float>(point[axis]));
  return bytes_of(planes);
}

// Indices that no int holds are negative: out of range.
std::vector<std::array<int, 3>> triangles_of(const std::string& bytes) {
  return values_of<std::array<int, 3>>(bytes);
}

void check_size(const std::string& bytes, std::size_t unit, const std::string& field,
                std::vector<Problem>& problems) {
  if (bytes.size() % unit != 0)
    problems.push_back(
        {field, join("has ", bytes.size(), " bytes, which is no multiple of ", unit)});
}

// A sixteenth of the memory is for bodies that may be asked for again.
MadeBody shared_body(const v1::MeshData& from, const BodySettings& settings,
                     const std::string& field, Scheduler* scheduler) {
  static BakedBodies bodies(static_cast<std::size_t>(memory_there_is() / 16));
  const std::string_view positions = positions_of(from);
  const std::string key = std::string(positions) + from.triangles() +
                          bytes_of(std::vector{static_cast<double>(positions.size()), settings.cell,
                                               settings.reach, settings.moves ? 1.0 : 0.0});
  return bodies.get(key, [&] {
    BodyMesh mesh{points_of<Vector3d>(positions), triangles_of(from.triangles())};
    if (scheduler == nullptr) return make_body(std::move(mesh), settings, field);
    IdleThreads pool(*scheduler, scheduler->threads());
    return make_body(std::move(mesh), settings, field, pool);
  });
}

// What of a mesh keeps it from being a body's, before its triangles are looked at.
std::vector<Problem> find_body_problems(const v1::MeshData& mesh, const std::string& field) {
  std::vector<Problem> problems;
  check_size(mesh.positions_m(), 12, field + ".positions_m", problems);
  check_size(mesh.triangles(), sizeof(Triangle), field + ".triangles", problems);
  check_size(mesh.poses().positions_m(), 12, field + ".poses.positions_m", problems);
  const auto refuse = [&](bool given, const char* name) {
    if (given) problems.push_back({join(field, ".", name), "is for sheets; a body has none"});
  };
  refuse(!mesh.flat_m().empty(), "flat_m");
  refuse(!mesh.flat_triangles().empty(), "flat_triangles");
  refuse(mesh.panels_size() > 0, "panels");
  return problems;
}

// As they are given.
Poses read_poses(const v1::Poses& from) {
  return {{from.times_s().begin(), from.times_s().end()},
          values_of<float>(from.positions_m()),
          {},
          {},
          {}};
}

std::vector<Problem> find_pose_problems(const Poses& poses, const v1::MeshData& mesh,
                                        const std::string& field) {
  const std::size_t own = mesh.positions_m().size() / 12, posed = positions_of(mesh).size() / 12;
  auto problems = find_problems(poses, own > 0 ? own : posed, field + ".poses");
  if (own > 0 && own != posed)
    problems.push_back(
        {field + ".positions_m", join("has ", own, " vertices; its poses have ", posed)});
  return problems;
}

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
  const std::string_view bytes = has_flat ? mesh.flat_m() : positions_of(mesh);
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

Converted<Triangles> to_mesh(const v1::MeshData& from, const std::string& field) {
  std::vector<Problem> problems;
  check_size(from.positions_m(), 12, field + ".positions_m", problems);
  check_size(from.triangles(), sizeof(Triangle), field + ".triangles", problems);
  check_size(from.flat_m(), 8, field + ".flat_m", problems);
  check_size(from.flat_triangles(), sizeof(Triangle), field + ".flat_triangles", problems);
  if (from.has_poses())
    problems.push_back({field + ".poses", "is for bodies that move; a sheet has none"});
  if (from.positions_m().empty() && (from.flat_m().empty() || !from.flat_triangles().empty()))
    problems.push_back({field + ".positions_m",
                        "is absent; give positions, or a flat shape of which every corner is a "
                        "particle"});
  if (!problems.empty()) return problems;

  TriangleMesh mesh;
  mesh.start = points_of<Vector3d>(from.positions_m());
  mesh.triangles = triangles_of(from.triangles());
  mesh.flat = points_of<Vector2d>(from.flat_m());
  mesh.flat_triangles = triangles_of(from.flat_triangles());
  for (const v1::Panel& panel : from.panels())
    mesh.panels.push_back({panel.name(), panel.triangle_count(), panel.grain_rad()});
  for (const v1::Fold& fold : from.folds())
    mesh.folds.push_back({{fold.particles().begin(), fold.particles().end()}, fold.angle_rad()});
  Triangles made = complete(std::move(mesh));
  problems = find_problems(*made, field);
  if (problems.empty()) return made;
  return problems;
}

Converted<ConvertedBody> to_body(const v1::MeshData& from, std::optional<double> cell, double reach,
                                 const std::string& field, Scheduler* scheduler) {
  std::vector<Problem> problems = find_body_problems(from, field);
  ConvertedBody result;
  if (from.has_poses() && problems.empty()) {
    Poses poses = read_poses(from.poses());
    problems = find_pose_problems(poses, from, field);
    if (problems.empty()) result.poses = complete(std::move(poses));
  }
  if (!problems.empty()) return problems;
  BodySettings settings{cell.value_or(0), reach, result.poses != nullptr};
  MadeBody made = shared_body(from, settings, field, scheduler);
  if (!made.body) return std::move(made.problems);
  if (result.poses) settings.cell = least_pose_cell(*result.poses, made.body->mesh.triangles);
  if (settings.cell > made.body->grid.cell) made = shared_body(from, settings, field, scheduler);
  result.body = std::move(made.body);
  return result;
}

std::vector<Problem> find_problems(const v1::MeshData& mesh, const std::string& field) {
  if (mesh.has_poses()) {
    auto problems = find_body_problems(mesh, field);
    if (problems.empty()) problems = find_pose_problems(read_poses(mesh.poses()), mesh, field);
    if (!problems.empty()) return problems;
    return mend({points_of<Vector3d>(positions_of(mesh)), triangles_of(mesh.triangles())}, field)
        .problems;
  }
  auto sheet = to_mesh(mesh, field);
  if (std::holds_alternative<Triangles>(sheet)) return {};
  if (!mesh.positions_m().empty()) {
    auto body =
        mend({points_of<Vector3d>(mesh.positions_m()), triangles_of(mesh.triangles())}, field);
    const bool whole =
        mesh.positions_m().size() % 12 == 0 && mesh.triangles().size() % sizeof(Triangle) == 0;
    if (whole && (body.problems.empty() || mesh.flat_m().empty())) return std::move(body.problems);
  }
  return std::get<std::vector<Problem>>(std::move(sheet));
}

v1::MeshData topology_of(const SheetShape& shape) {
  v1::MeshData to;
  to.set_triangles(bytes_of(triangles_of(shape)));
  std::vector<Vector2d> flat;
  if (const auto* mesh = std::get_if<Triangles>(&shape)) {
    flat = (*mesh)->flat;
    to.set_flat_triangles(bytes_of((*mesh)->flat_triangles));
    for (const Panel& panel : (*mesh)->panels) {
      v1::Panel* added = to.add_panels();
      added->set_name(panel.name);
      added->set_triangle_count(panel.triangles);
      added->set_grain_rad(panel.grain);
    }
    for (const Fold& fold : (*mesh)->folds) {
      v1::Fold* added = to.add_folds();
      added->mutable_particles()->Assign(fold.particles.begin(), fold.particles.end());
      added->set_angle_rad(fold.angle);
    }
  } else {
    for (int i = 0; i < particle_count(shape); ++i) {
      const Vector3d at = local_position(shape, i);
      flat.emplace_back(at.z(), at.x());
    }
  }
  to.set_flat_m(planes_of(flat));
  return to;
}

v1::MeshData to_proto(const Triangles& mesh) {
  v1::MeshData to = topology_of(mesh);
  to.set_positions_m(planes_of(mesh->start));
  return to;
}

std::int64_t particles_of(const v1::MeshData& mesh) {
  const std::size_t positions = positions_of(mesh).size() / 12;
  return static_cast<std::int64_t>(positions > 0 ? positions : corners_of(mesh));
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
  facts.set_poses(mesh.poses().times_s_size());
  return facts;
}

}  // namespace weft

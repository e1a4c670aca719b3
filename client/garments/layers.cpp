#include "client/garments/layers.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <set>
#include <utility>
#include <vector>

#include "client/problem.h"
#include "client/recording/points.h"
#include "client/recording/reader.h"

namespace weft::client {
namespace {

using Eigen::Vector3d;

constexpr double kGap = 0.004;  // between what is worn and where panels start, m

Eigen::Quaterniond rotation_of(const v1::Placement& place) {
  if (!place.has_rotation()) return Eigen::Quaterniond::Identity();
  const v1::Rotation& turn = place.rotation();
  return Eigen::Quaterniond(turn.w(), turn.x(), turn.y(), turn.z()).normalized();
}

// "shirt", or "shirt-2" where the scene has a shirt.
std::string free_name(const v1::Scene& scene, const std::string& wanted) {
  const auto is_taken = [&](const std::string& name) {
    return std::ranges::any_of(scene.sheets(),
                               [&](const auto& each) { return each.name() == name; });
  };
  std::string name = wanted;
  for (int number = 2; is_taken(name); ++number) name = fmt::format("{}-{}", wanted, number);
  return name;
}

using Planes = Eigen::Matrix<float, Eigen::Dynamic, 3>;  // x of all, then y, then z

using Triangle = std::array<std::uint32_t, 3>;

std::vector<Triangle> triangles_of(const v1::MeshData& mesh) {
  std::vector<Triangle> triangles(mesh.triangles().size() / sizeof(Triangle));
  std::memcpy(triangles.data(), mesh.triangles().data(), triangles.size() * sizeof(Triangle));
  return triangles;
}

std::set<std::array<std::uint32_t, 2>> edges_of(const v1::MeshData& mesh) {
  std::set<std::array<std::uint32_t, 2>> edges;
  for (const auto& [a, b, c] : triangles_of(mesh))
    for (const auto& [begin, end] : {std::pair(a, b), {b, c}, {c, a}})
      edges.insert({std::min(begin, end), std::max(begin, end)});
  return edges;
}

// What is worn, with directions out of the body.
struct Surface {
  std::vector<Vector3d> points, normals;  // m
};

Surface surface_of(const v1::Scene& worn) {
  Surface surface;
  for (const v1::Sheet& sheet : worn.sheets()) {
    const auto first = surface.points.size();
    for (int k = 0; k + 2 < sheet.start_positions_m_size(); k += 3)
      surface.points.emplace_back(sheet.start_positions_m(k), sheet.start_positions_m(k + 1),
                                  sheet.start_positions_m(k + 2));
    surface.normals.resize(surface.points.size(), Vector3d::Zero());
    for (const auto& [a, b, c] : triangles_of(sheet.triangles().data())) {
      const auto at = [&](std::uint32_t particle) { return surface.points[first + particle]; };
      const Vector3d normal = (at(b) - at(a)).cross(at(c) - at(a));
      for (const std::uint32_t particle : {a, b, c}) surface.normals[first + particle] += normal;
    }
  }
  for (Vector3d& normal : surface.normals) normal.normalize();
  return surface;
}

// How far out along z in the panel's coordinates what is worn reaches, behind or before its
// outline.
double reach_of(const v1::PatternPanel& panel, const Surface& worn) {
  constexpr double kBeside = 0.02, kFar = 0.15;  // m: what may come in the way, and what may not
  Eigen::AlignedBox2d outline;
  for (const v1::PatternEdge& edge : panel.edges())
    for (int k = 0; k + 1 < edge.points_m_size(); k += 2)
      outline.extend(Eigen::Vector2d(edge.points_m(k), edge.points_m(k + 1)));
  outline.min().array() -= kBeside;
  outline.max().array() += kBeside;
  const v1::Placement& place = panel.placement();
  const Vector3d origin(place.origin_m().x(), place.origin_m().y(), place.origin_m().z());
  const Eigen::Quaterniond back = rotation_of(place).conjugate();
  double reach = -kFar;
  for (const Vector3d& x : worn.points) {
    const Vector3d seen = back * (x - origin);
    if (seen.z() < kFar && outline.contains(seen.head<2>())) reach = std::max(reach, seen.z());
  }
  return reach;
}

// By how much a point is to come out, m; zero where it is out, or far away.
Vector3d way_out(const Surface& worn, const Vector3d& x) {
  constexpr double kNear = 0.025;
  const auto nearest = std::ranges::min_element(
      worn.points, {}, [&](const Vector3d& point) { return (point - x).squaredNorm(); });
  if (nearest == worn.points.end() || (*nearest - x).norm() > kNear) return Vector3d::Zero();
  const Vector3d& out = worn.normals[static_cast<std::size_t>(nearest - worn.points.begin())];
  return std::max(0.0, kGap - (x - *nearest).dot(out)) * out;
}

// What reaches from panel to panel, where seams will be, starts out of what is worn: no particle
// and no edge passes through it.
void push_out(const Surface& worn, v1::MeshData& mesh) {
  constexpr double kSample = 0.01;  // m, along an edge
  constexpr int kRounds = 20;
  std::string& bytes = *mesh.mutable_positions_m();
  Planes planes(bytes.size() / 12, 3);
  std::memcpy(planes.data(), bytes.data(), bytes.size());
  Eigen::Matrix3Xd x = planes.transpose().cast<double>();
  auto edges = edges_of(mesh);
  std::vector<double> lengths;
  for (const auto& [begin, end] : edges) lengths.push_back((x.col(end) - x.col(begin)).norm());
  std::ranges::nth_element(lengths, lengths.begin() + std::ssize(lengths) / 2);
  const double reaching = 2 * lengths[lengths.size() / 2];
  std::erase_if(
      edges, [&](const auto& edge) { return (x.col(edge[1]) - x.col(edge[0])).norm() < reaching; });
  for (int round = 0; round < kRounds && !edges.empty(); ++round)
    std::erase_if(edges, [&](const auto& edge) {
      auto begin = x.col(edge[0]), end = x.col(edge[1]);
      const int parts = std::max(1, static_cast<int>((end - begin).norm() / kSample));
      bool was_out = true;
      for (int k = 0; k <= parts; ++k) {
        const double share = static_cast<double>(k) / parts;
        const Vector3d way = way_out(worn, begin + share * (end - begin));
        if (way.isZero()) continue;
        was_out = false;
        const double both = share * share + (1 - share) * (1 - share);
        begin += (1 - share) / both * way;
        end += share / both * way;
      }
      return was_out;
    });
  planes = x.transpose().cast<float>();
  std::memcpy(bytes.data(), planes.data(), bytes.size());
}

}  // namespace

double place_over(v1::Pattern& pattern, const v1::Scene& worn) {
  const Surface surface = surface_of(worn);
  double farthest = 0;
  for (v1::PatternPanel& panel : *pattern.mutable_panels()) {
    const double way = reach_of(panel, surface) + kGap;
    if (way <= 0) continue;
    farthest = std::max(farthest, way);
    const Vector3d moved = rotation_of(panel.placement()) * Vector3d(0, 0, way);
    v1::Vector3& origin = *panel.mutable_placement()->mutable_origin_m();
    origin.set_x(origin.x() + moved.x());
    origin.set_y(origin.y() + moved.y());
    origin.set_z(origin.z() + moved.z());
  }
  return farthest;
}

v1::Scene worn_at_end(const std::string& path) {
  RecordingReader recording(path);
  v1::Scene worn = with_meshes(recording.scene(), recording.assets());
  for (const v1::Collider& body : worn.colliders())
    if (body.path_size() > 0 || body.mesh().data().has_poses())
      throw unreadable(path, fmt::format("\"{}\" moves; what is worn stands still", body.name()));
  const v1::Frame end = recording.read(recording.last_frame());
  std::size_t first = 0;
  for (int s = 0; s < worn.sheets_size(); ++s) {
    const std::size_t count = particle_count(recording.header().sheets(s));
    v1::Sheet& sheet = *worn.mutable_sheets(s);
    sheet.clear_placement();
    sheet.clear_start_velocities_m_per_s();
    sheet.clear_start_positions_m();
    const Points points = read_points(end.positions_m(), recording.header(), first, count);
    for (std::size_t i = 0; i < count; ++i)
      for (const double value : {points.x[i], points.y[i], points.z[i]})
        sheet.add_start_positions_m(value);
    first += count;
  }
  for (v1::Hold& hold : *worn.mutable_dressing()->mutable_holds())
    if (hold.sheet().empty()) hold.set_sheet(worn.sheets(0).name());
  return worn;
}

void wear_over(v1::Scene& garment, v1::Scene worn) {
  v1::Sheet& sheet = *garment.mutable_sheets(0);
  push_out(surface_of(worn), *sheet.mutable_triangles()->mutable_data());
  sheet.set_name(free_name(worn, sheet.name()));
  for (v1::Hold& hold : *garment.mutable_dressing()->mutable_holds()) hold.set_sheet(sheet.name());
  garment.mutable_dressing()->mutable_holds()->MergeFrom(worn.dressing().holds());
  worn.mutable_sheets()->Add(std::move(sheet));
  garment.mutable_sheets()->Swap(worn.mutable_sheets());
  garment.mutable_colliders()->Swap(worn.mutable_colliders());
}

}  // namespace weft::client

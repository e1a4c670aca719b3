#include "client/garments/layers.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "client/exports/normals.h"
#include "client/message_values.h"
#include "client/problem.h"
#include "client/recording/reader.h"
#include "client/sheet_layout.h"

namespace weft::client {
namespace {

using Eigen::Vector3d;

constexpr double kGap = 0.004;  // between what is worn and where panels start, m

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

std::set<std::array<std::int32_t, 2>> edges_of(const v1::MeshData& mesh) {
  std::set<std::array<std::int32_t, 2>> edges;
  for (const auto& [a, b, c] : values_of<Triangle>(mesh.triangles()))
    for (const auto& [begin, end] : {std::pair(a, b), {b, c}, {c, a}})
      edges.insert({std::min(begin, end), std::max(begin, end)});
  return edges;
}

// Of all sheets, particles numbered through.
std::vector<std::uint32_t> triangles_of(const RecordingReader& recording) {
  std::vector<std::uint32_t> all;
  for (const SheetMesh& sheet : meshes_of(recording.header(), recording.topology()))
    for (const Triangle& triangle : sheet.triangles)
      for (const std::int32_t particle : triangle)
        all.push_back(static_cast<std::uint32_t>(sheet.layout.first_particle() + particle));
  return all;
}

Vector3d point(const Points& points, std::size_t i) {
  return {points.x[i], points.y[i], points.z[i]};
}

// How far out along z in the panel's coordinates what is worn reaches, behind or before its
// outline.
double reach_of(const v1::PatternPanel& panel, const Points& worn) {
  constexpr double kBeside = 0.02, kFar = 0.15;  // m: what may come in the way, and what may not
  Eigen::AlignedBox2d outline;
  for (const v1::PatternEdge& edge : panel.edges())
    for (int k = 0; k + 1 < edge.points_m_size(); k += 2)
      outline.extend(Eigen::Vector2d(edge.points_m(k), edge.points_m(k + 1)));
  outline.min().array() -= kBeside;
  outline.max().array() += kBeside;
  const v1::Placement& place = panel.placement();
  const Vector3d origin = vector_of(place.origin_m());
  const Eigen::Quaterniond back = rotation_of(place).conjugate();
  double reach = -kFar;
  for (std::size_t i = 0; i < worn.x.size(); ++i) {
    const Vector3d seen = back * (point(worn, i) - origin);
    if (seen.z() < kFar && outline.contains(seen.head<2>())) reach = std::max(reach, seen.z());
  }
  return reach;
}

// By how much a point is to come out, m; zero where it is out, or far away.
Vector3d way_out(const Worn& worn, const Vector3d& x) {
  constexpr double kNear = 0.025;
  double squared = kNear * kNear;
  std::optional<std::size_t> nearest;
  for (std::size_t i = 0; i < worn.points.x.size(); ++i) {
    const double there = (point(worn.points, i) - x).squaredNorm();
    if (there >= squared) continue;
    squared = there;
    nearest = i;
  }
  if (!nearest) return Vector3d::Zero();
  const auto& [u, v, w] = worn.normals[*nearest];
  const Vector3d out(u, v, w);
  return std::max(0.0, kGap - (x - point(worn.points, *nearest)).dot(out)) * out;
}

// What reaches from panel to panel, where seams will be, starts out of what is worn: no particle
// and no edge passes through it.
void push_out(const Worn& worn, v1::MeshData& mesh) {
  constexpr double kSample = 0.01;  // m, along an edge
  constexpr int kRounds = 20;
  std::string& bytes = *mesh.mutable_positions_m();
  std::vector<float> values = values_of<float>(bytes);
  Eigen::Map<Planes> planes(values.data(), std::ssize(values) / 3, 3);
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
  bytes.assign(reinterpret_cast<const char*>(values.data()), bytes.size());
}

}  // namespace

double place_over(v1::Pattern& pattern, const Worn& worn) {
  double farthest = 0;
  for (v1::PatternPanel& panel : *pattern.mutable_panels()) {
    const double way = reach_of(panel, worn.points) + kGap;
    if (way <= 0) continue;
    farthest = std::max(farthest, way);
    v1::Placement& place = *panel.mutable_placement();
    const Vector3d to = vector_of(place.origin_m()) + rotation_of(place) * Vector3d(0, 0, way);
    place.mutable_origin_m()->set_x(to.x());
    place.mutable_origin_m()->set_y(to.y());
    place.mutable_origin_m()->set_z(to.z());
  }
  return farthest;
}

Worn worn_at_end(const std::string& path) {
  RecordingReader recording(path);
  Worn worn{with_meshes(recording.scene(), recording.assets()), {}, {}};
  for (const v1::Collider& body : worn.scene.colliders())
    if (body.path_size() > 0 || body.mesh().data().has_poses())
      throw unreadable(path, fmt::format("\"{}\" moves; what is worn stands still", body.name()));
  worn.points =
      read_points(recording.read(recording.last_frame()).positions_m(), recording.header());
  worn.normals = normals_of(worn.points, triangles_of(recording));
  std::size_t i = 0;
  for (int s = 0; s < worn.scene.sheets_size(); ++s) {
    v1::Sheet& sheet = *worn.scene.mutable_sheets(s);
    sheet.clear_placement();
    sheet.clear_start_velocities_m_per_s();
    sheet.clear_start_positions_m();
    for (const std::size_t end = i + particle_count(recording.header().sheets(s)); i < end; ++i)
      for (const double value : point(worn.points, i)) sheet.add_start_positions_m(value);
  }
  for (v1::Hold& hold : *worn.scene.mutable_dressing()->mutable_holds())
    if (hold.sheet().empty()) hold.set_sheet(worn.scene.sheets(0).name());
  return worn;
}

void wear_over(v1::Scene& garment, Worn worn) {
  v1::Sheet& sheet = *garment.mutable_sheets(0);
  push_out(worn, *sheet.mutable_triangles()->mutable_data());
  sheet.set_name(free_name(worn.scene, sheet.name()));
  for (v1::Hold& hold : *garment.mutable_dressing()->mutable_holds()) hold.set_sheet(sheet.name());
  garment.mutable_dressing()->mutable_holds()->MergeFrom(worn.scene.dressing().holds());
  worn.scene.mutable_sheets()->Add(std::move(sheet));
  garment.mutable_sheets()->Swap(worn.scene.mutable_sheets());
  garment.mutable_colliders()->Swap(worn.scene.mutable_colliders());
}

}  // namespace weft::client

#include "tests/reports/picture.h"

#include <Eigen/Geometry>
#include <fstream>
#include <span>
#include <stdexcept>
#include <stop_token>

#include "client/exports/normals.h"
#include "client/render/tracer.h"
#include "client/render/webp.h"
#include "tests/support/core/scenes.h"

namespace weft::reports {
namespace {

constexpr int kWidth = 480, kHeight = 360;

client::Points points_of(const Eigen::Ref<const Matrix3Xd>& x) {
  client::Points points;
  for (const auto& column : x.colwise()) {
    points.x.push_back(column.x());
    points.y.push_back(column.y());
    points.z.push_back(column.z());
  }
  return points;
}

std::vector<std::uint32_t> indices_of(std::span<const std::array<int, 3>> triangles) {
  std::vector<std::uint32_t> indices;
  for (const auto& triangle : triangles)
    indices.insert(indices.end(), triangle.begin(), triangle.end());
  return indices;
}

client::Body body_of(const Collider& collider, double time) {
  const Vector3d offset = offset_at(collider.path, time);
  if (const auto* box = std::get_if<Box>(&collider.shape))
    return client::Cuboid{box->center + offset, box->half_size, box->rotation};
  if (const auto* plane = std::get_if<Plane>(&collider.shape))
    return client::HalfSpace{plane->point + offset, plane->normal.normalized()};
  const BodyMesh& mesh = std::get<SharedBody>(collider.shape)->mesh;
  client::Solid solid;
  solid.offset = offset;
  solid.corners = points_of(
      Matrix3Xd::Map(mesh.vertices[0].data(), 3, static_cast<Eigen::Index>(mesh.vertices.size())));
  solid.triangles = indices_of(mesh.triangles);
  solid.normals = client::normals_of(solid.corners, solid.triangles);
  return solid;
}

}  // namespace

void draw(const Simulation& simulation, const std::filesystem::path& path) {
  const Scene& scene = simulation.scene();
  const Matrix3Xd x = testing::positions(simulation);
  client::Stage stage;
  Eigen::AlignedBox3d extent;
  for (const auto& place : x.colwise()) extent.extend(Vector3d(place));
  for (Eigen::Index first = 0; const SheetDefinition& sheet : scene.sheets) {
    const int count = sheet.particle_count();
    client::Surface& surface = stage.surfaces.emplace_back();
    surface.points = points_of(x.middleCols(first, count));
    surface.triangles = indices_of(triangles_of(sheet.shape));
    surface.normals = client::normals_of(surface.points, surface.triangles);
    surface.values.resize(static_cast<std::size_t>(count));
    surface.panels.resize(surface.triangles.size() / 3,
                          static_cast<int>(stage.surfaces.size()) - 1);
    first += count;
  }
  for (const Collider& collider : scene.colliders)
    stage.bodies.push_back(body_of(collider, simulation.time()));

  client::Studio studio;
  const client::Outlook outlook{30, 35};
  studio.directions = client::directions_of({0, -9.8, 0}, outlook);
  studio.colouring = client::Colouring::kPanels;
  studio.centre = extent.center();
  studio.radius = extent.diagonal().norm() / 2;
  studio.ground = {extent.min() - Vector3d(0, 0.05 * studio.radius, 0), Vector3d::UnitY()};
  client::CameraFit fit(studio.directions, outlook, static_cast<double>(kWidth) / kHeight, {});
  for (const auto& place : x.colwise()) fit.add({place, 0.0});
  client::Picture picture(kWidth, kHeight);
  client::Tracer(stage, studio)
      .draw(fit.camera(), picture, {0, 0, kWidth, kHeight}, std::stop_token());
  std::ofstream file(path, std::ios::binary);
  file << client::webp(picture);
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path.string());
}

}  // namespace weft::reports

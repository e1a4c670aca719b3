#include "tests/reports/blender.h"

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "core/cloth_contact/cloth.h"
#include "core/cloth_contact/cuts.h"
#include "tests/support/core/bodies.h"
#include "tests/support/temporary_directory.h"

namespace weft::reports {
namespace {

using nlohmann::json;

json point(const Vector3d& x) { return {x.x(), x.y(), x.z()}; }

json path_of(const Path& path, const Vector3d& start, double step, int frames) {
  json places = json::array();
  for (int frame = 0; frame <= frames; ++frame)
    places.push_back(point(start + offset_at(path, frame * step)));
  return places;
}

// Vertices, triangles and where they are shifted to.
json body(const Collider& collider, double step, int frames) {
  BodyMesh mesh;
  Vector3d place = Vector3d::Zero();
  if (const auto* shared = std::get_if<SharedBody>(&collider.shape)) {
    mesh = (*shared)->mesh;
  } else if (const auto* box = std::get_if<Box>(&collider.shape)) {
    mesh = testing::box_mesh(box->half_size, box->rotation);
    place = box->center;
  } else {
    constexpr double kHalf = 5, kDepth = 0.1;  // m: a slab under the plane y = 0
    mesh = testing::box_mesh({kHalf, kDepth, kHalf});
    place = std::get<Plane>(collider.shape).point - Vector3d(0, kDepth, 0);
  }
  json vertices = json::array();
  for (const Vector3d& vertex : mesh.vertices) vertices.push_back(point(vertex));
  return {{"vertices", vertices},
          {"triangles", mesh.triangles},
          {"places", path_of(collider.path, place, step, frames)}};
}

// Where a sheet is without strain, where every particle has one place there; otherwise its start.
json rest_of(const SheetDefinition& sheet, const Matrix3Xd& start) {
  SheetDefinition flat = sheet;
  flat.start_positions.clear();
  const TriangleMesh& mesh = *std::get<Triangles>(sheet.shape);
  const bool sewn = mesh.flat.size() != static_cast<std::size_t>(start.cols());
  const Matrix3Xd rest = sewn ? start : start_positions(flat);
  json places = json::array();
  for (const auto& x : rest.colwise()) places.push_back(point(x));
  return places;
}

json order_of(const Scene& scene, int frames) {
  const double step = scene.solver.frame_step;
  json order = {{"frames", frames},
                {"frame_step", step},
                {"gravity", point(scene.environment.gravity)},
                {"bodies", json::array()},
                {"vertices", json::array()},
                {"rest", json::array()},
                {"pins", json::array()}};
  const Cloth cloth(scene.sheets);
  order["triangles"] = cloth.triangles;
  for (const Collider& collider : scene.colliders)
    order["bodies"].push_back(body(collider, step, frames));
  for (std::size_t s = 0; s < scene.sheets.size(); ++s) {
    const SheetDefinition& sheet = scene.sheets[s];
    const Matrix3Xd start = start_positions(sheet);
    for (const auto& x : start.colwise()) order["vertices"].push_back(point(x));
    for (const json& x : rest_of(sheet, start)) order["rest"].push_back(x);
    for (const Pin& pin : sheet.pins)
      for (const int particle : pin.particles)
        order["pins"].push_back({{"vertex", cloth.first_particle[s] + particle},
                                 {"places", path_of(pin.path, start.col(particle), step, frames)}});
  }
  const SheetDefinition& first = scene.sheets.front();
  const auto& textile = std::get<MeasuredTextile>(first.textile.model);
  order["density"] = textile.areal_density;
  order["stretch"] = (textile.tensile_warp + textile.tensile_weft) / 2;
  order["shear"] = textile.shear;
  order["spacing"] = first.spacing();
  order["thickness"] = first.thickness_or_default();
  return order;
}

// What a command writes; nothing where it fails.
std::optional<std::string> output_of(const std::string& command) {
  FILE* pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return std::nullopt;
  std::string text;
  std::array<char, 4096> part{};
  while (const std::size_t size = std::fread(part.data(), 1, part.size(), pipe))
    text.append(part.data(), size);
  if (::pclose(pipe) != 0) return std::nullopt;
  return text;
}

std::vector<Matrix3Xd> read_positions(std::ifstream& file, const Scene& scene) {
  std::vector<Matrix3Xd> x;
  for (const SheetDefinition& sheet : scene.sheets) {
    Eigen::Matrix3Xf values(3, sheet.particle_count());
    file.read(reinterpret_cast<char*>(values.data()),
              values.size() * static_cast<std::streamsize>(sizeof(float)));
    x.push_back(values.cast<double>());
  }
  if (!file) throw std::runtime_error("Blender wrote too few positions");
  return x;
}

}  // namespace

std::optional<std::string> blender_version() {
  const auto text = output_of("blender --version 2>/dev/null");
  if (!text) return std::nullopt;
  return text->substr(0, text->find('\n'));
}

BlenderRun run_blender(const Scene& scene, int frames) {
  const testing::TemporaryDirectory folder;
  std::ofstream(folder.path("order.json")) << order_of(scene, frames);
  const auto said = output_of(fmt::format(
      "blender --background --factory-startup --threads 1 --python-exit-code 1 --python "
      "{} -- {} 2>&1",
      WEFT_BLENDER_CLOTH, folder.path("")));
  if (!said) throw std::runtime_error("Blender fails");
  BlenderRun run;
  run.frames = json::parse(std::ifstream(folder.path("times.json"))).get<std::vector<double>>();
  std::ifstream positions(folder.path("positions"), std::ios::binary);
  for (int frame = 1; frame <= frames; ++frame)
    run.cuts.push_back(count_cuts(scene.sheets, read_positions(positions, scene), 0).count);
  return run;
}

}  // namespace weft::reports

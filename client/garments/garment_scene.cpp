#include "client/garments/garment_scene.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <string_view>

#include "client/imports/import.h"
#include "client/imports/mesh_data.h"
#include "client/output/text.h"

namespace weft::client {
namespace {

using Garments = v1::GarmentService::Stub;

// What the server makes of a pattern; its fields in words of the file.
v1::BuildGarmentResponse build(Connection& connection, const GarmentOrder& order) {
  v1::BuildGarmentRequest request;
  *request.mutable_pattern() = order.pattern;
  if (order.edge_m) request.set_edge_m(*order.edge_m);
  constexpr std::string_view kPrefix = "pattern.";
  try {
    return connection.call(&Garments::BuildGarment, request);
  } catch (const Problem& problem) {
    const auto in_file = [&](std::string field) {
      if (field.starts_with(kPrefix)) field.erase(0, kPrefix.size());
      return field == "edge_m" ? order.edge_field : field;
    };
    Problem placed(problem.exit, problem.code, problem.reason, in_file(problem.what()));
    for (const auto& [field, description] : problem.violations)
      placed.violations.push_back({in_file(field), description});
    throw placed;
  }
}

// What there is to say about a garment.
std::string built_text(const v1::Pattern& pattern, const v1::BuildGarmentResponse& built) {
  const v1::MeshData& mesh = built.sheet().triangles().data();
  Facts facts;
  std::int64_t triangles = 0;
  for (const v1::Panel& panel : mesh.panels()) triangles += panel.triangle_count();
  facts.add("sheet", fmt::format("{}, {}, lowest {:.2f} of an edge",
                                 count_of(static_cast<std::int64_t>(mesh.positions_m().size()) / 12,
                                          "particle"),
                                 count_of(triangles, "triangle"), built.least_height()));
  for (const v1::Panel& panel : mesh.panels())
    facts.add("panels",
              fmt::format("{}: {}", panel.name(), count_of(panel.triangle_count(), "triangle")));
  facts.add("seams", count_of(pattern.seams_size(), "seam"));
  std::map<std::string, std::pair<int, double>> labels;
  for (const v1::BuiltEdge& edge : built.edges())
    if (!edge.label().empty()) {
      ++labels[edge.label()].first;
      labels[edge.label()].second += edge.length_m();
    }
  for (const auto& [label, sum] : labels)
    facts.add("edges",
              fmt::format("{}: {}, {:.4g} m", label, count_of(sum.first, "edge"), sum.second));
  for (const v1::Warning& note : built.notes())
    facts.add("note", fmt::format("{}: {}", note.code(), note.message()));
  return facts.text();
}

v1::Collider body_of(const std::string& name, const ImportedMesh& mesh) {
  v1::Collider body;
  body.set_name(name);
  *body.mutable_mesh()->mutable_data() = body_data(mesh);
  return body;
}

}  // namespace

v1::Collider garment_body(const std::string& path) {
  return body_of(plain_name(std::filesystem::path(path).stem().string(), "body"),
                 import_body(path, {}));
}

v1::Collider garment_body(const DressForm& form) {
  ImportedMesh mesh;
  mesh.positions = form.mesh.vertices;
  mesh.triangles = form.mesh.triangles;
  return body_of("body", mesh);
}

GarmentScene make_garment_scene(Connection& connection, const GarmentOrder& order) {
  constexpr double kDamping = 2e-3;  // kg/s: brings wool to rest within some seconds
  const v1::BuildGarmentResponse built = build(connection, order);
  GarmentScene made;
  made.text = built_text(order.pattern, built);
  made.json = to_json(built, Defaults::kLeftOut);
  made.json.erase("sheet");

  v1::Sheet* sheet = made.scene.add_sheets();
  *sheet = built.sheet();
  sheet->set_name(order.name);
  *sheet->mutable_textile() = order.textile;
  if (!sheet->textile().has_damping_kg_per_s() && !sheet->textile().has_damping_ratio())
    sheet->mutable_textile()->set_damping_kg_per_s(kDamping);
  for (const v1::Collider& body : order.bodies) *made.scene.add_colliders() = body;
  made.scene.set_cloth_contact(true);
  *made.scene.mutable_dressing() = built.dressing();
  if (order.deflate_m) made.scene.mutable_dressing()->set_deflate_m(*order.deflate_m);
  return made;
}

}  // namespace weft::client

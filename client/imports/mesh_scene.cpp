#include "client/imports/mesh_scene.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>

#include "client/imports/mesh_data.h"
#include "client/imports/pins.h"

namespace weft::client {
namespace {

// As templates have it: brings wool to rest within some seconds.
constexpr double kDamping = 2e-3;  // kg/s

void set_textiles(v1::Sheet& sheet, const MeshSceneOptions& options) {
  sheet.mutable_textile()->set_preset("wool_tropical");
  sheet.mutable_textile()->set_damping_kg_per_s(kDamping);
  if (options.textile) sheet.mutable_textile()->MergeFrom(*options.textile);
  auto& panels = *sheet.mutable_triangles()->mutable_data()->mutable_panels();
  for (const auto& given : options.panel_textiles) {
    const auto found = std::find_if(panels.begin(), panels.end(), [&](const v1::Panel& panel) {
      return panel.name() == given.first;
    });
    if (found == panels.end()) {
      std::vector<std::string> names;
      for (const v1::Panel& panel : panels) names.push_back(panel.name());
      throw usage_problem(fmt::format("--panel-textile: the mesh has no panel \"{}\"; it has {}",
                                      given.first, fmt::join(names, ", ")));
    }
    *found->mutable_textile() = given.second;
  }
}

}  // namespace

v1::Scene make_mesh_scene(const std::string& path, const ImportedMesh& mesh,
                          const MeshSceneOptions& options) {
  v1::Scene scene;
  scene.set_cloth_contact(true);
  v1::Sheet* sheet = scene.add_sheets();
  sheet->set_name(plain_name(std::filesystem::path(path).stem().string(), "sheet"));
  *sheet->mutable_triangles()->mutable_data() = mesh_data(mesh, options.grain_rad);
  set_textiles(*sheet, options);
  for (const std::string& words : options.pins) {
    v1::Pin* pin = sheet->add_pins();
    for (const int particle : select_particles(mesh, words)) pin->add_particles(particle);
  }
  if (options.accuracy) scene.mutable_solver()->set_accuracy(*options.accuracy);
  return scene;
}

}  // namespace weft::client

#include "client/scene_file.h"

#include <fmt/format.h>

#include "client/assets.h"
#include "client/imports/import.h"
#include "client/input_file.h"
#include "client/json_file.h"
#include "client/output/json.h"
#include "client/problem.h"

namespace weft::client {
namespace {

// "sheets[0].grid" of "session.scene.sheets[0].grid"
std::string place_in_file(std::string field) {
  constexpr std::string_view kPrefix = "session.scene.";
  if (field.starts_with(kPrefix)) field.erase(0, kPrefix.size());
  return field;
}

// What people take for a scene: where cloth is drawn, not simulated.
void refuse_mesh(const std::string& path) {
  if (is_mesh_file(path))
    throw malformed(path, fmt::format("is a mesh, not a scene file; `weft scene new --mesh {} -o "
                                      "scene.json` makes one of it, and says what it found",
                                      path));
  for (const char* ending :
       {".fbx", ".stl", ".ply", ".usd", ".usda", ".usdc", ".dxf", ".abc", ".dae", ".blend"})
    if (path.ends_with(ending))
      throw malformed(
          path,
          "is a mesh, not a scene file, and of a format that weft does not read: export "
          "it as .obj or .glb with UV, then `weft scene new --mesh`");
}

}  // namespace

v1::Scene read_scene(const std::string& path) {
  refuse_mesh(path);
  const std::string text = read_text(path);
  const Json json = parse_json(path, text);
  if (json.is_object() && json.contains("values") && !json.contains("sheets"))
    throw malformed(path, "is a textile, not a scene; `weft scene new --textile` takes it");
  v1::Scene scene;
  read_message(path, text, scene);
  return scene;
}

v1::Session create_session(Connection& connection, const v1::Scene& scene,
                           v1::CreateSessionRequest request) try {
  // nothing is to be left of a scene that is only looked at
  *request.mutable_session()->mutable_scene() =
      request.validate_only() ? scene : upload_meshes(connection, scene);
  return connection.call(&v1::SessionService::Stub::CreateSession, request);
} catch (const Problem& problem) {
  if (problem.code == "RESOURCE_EXHAUSTED" && problem.reason.empty()) {  // of gRPC itself
    throw Problem(problem.exit, problem.code, "REQUEST_TOO_LARGE",
                  fmt::format("the scene's {} bytes are more than a request may have ({})",
                              scene.ByteSizeLong(), problem.what()));
  }
  Problem placed(problem.exit, problem.code, problem.reason, place_in_file(problem.what()));
  for (const auto& [field, description] : problem.violations) {
    placed.violations.push_back({place_in_file(field), description});
  }
  throw placed;
}

std::string scene_text(const v1::Scene& scene) {
  return to_json(scene, Defaults::kLeftOut).dump(2) + '\n';
}

}  // namespace weft::client

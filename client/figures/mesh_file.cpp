#include "client/figures/mesh_file.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <nlohmann/json.hpp>

namespace weft::client {
namespace {

template <class Value>
void append_value(std::string& bytes, Value value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// A part of a binary glTF file, filled up to a multiple of 4 bytes.
void append_chunk(std::string& file, const char (&type)[5], std::string bytes, char filling) {
  bytes.resize((bytes.size() + 3) / 4 * 4, filling);
  append_value(file, static_cast<std::uint32_t>(bytes.size()));
  file.append(type, 4);
  file += bytes;
}

}  // namespace

std::string obj_of(const FigureMesh& mesh) {
  std::string text;
  for (const Vector3d& v : mesh.vertices)
    text += fmt::format("v {:.6f} {:.6f} {:.6f}\n", v.x(), v.y(), v.z());
  for (const auto& [a, b, c] : mesh.triangles)
    text += fmt::format("f {} {} {}\n", a + 1, b + 1, c + 1);
  return text;
}

std::string glb_of(const FigureMesh& mesh) {
  constexpr int kFloat = 5126, kUnsignedInt = 5125;
  std::string data;
  Eigen::AlignedBox3f box;
  for (const Vector3d& v : mesh.vertices) {
    const Eigen::Vector3f place = v.cast<float>();
    for (const float value : place) append_value(data, value);
    box.extend(place);
  }
  const std::size_t positions = data.size();
  for (const auto& triangle : mesh.triangles)
    for (const int i : triangle) append_value(data, static_cast<std::uint32_t>(i));
  const auto list = [](const Eigen::Vector3f& v) { return nlohmann::json{v.x(), v.y(), v.z()}; };
  const nlohmann::json json{
      {"asset", {{"version", "2.0"}}},
      {"scene", 0},
      {"scenes", {{{"nodes", {0}}}}},
      {"nodes", {{{"mesh", 0}, {"name", "body"}}}},
      {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}}}}}}},
      {"buffers", {{{"byteLength", data.size()}}}},
      {"bufferViews",
       {{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", positions}},
        {{"buffer", 0}, {"byteOffset", positions}, {"byteLength", data.size() - positions}}}},
      {"accessors",
       {{{"bufferView", 0},
         {"componentType", kFloat},
         {"count", mesh.vertices.size()},
         {"type", "VEC3"},
         {"min", list(box.min())},
         {"max", list(box.max())}},
        {{"bufferView", 1},
         {"componentType", kUnsignedInt},
         {"count", 3 * mesh.triangles.size()},
         {"type", "SCALAR"}}}}};
  std::string chunks;
  append_chunk(chunks, "JSON", json.dump(), ' ');
  append_chunk(chunks, "BIN\0", std::move(data), '\0');
  std::string file = "glTF";
  append_value(file, std::uint32_t{2});
  append_value(file, static_cast<std::uint32_t>(chunks.size() + 12));
  return file + chunks;
}

}  // namespace weft::client

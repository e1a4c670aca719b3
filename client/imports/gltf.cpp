#include "client/imports/gltf.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "client/input_file.h"

#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#define TINYGLTF_NO_FS
#include <tiny_gltf.h>

namespace weft::client {
namespace {

using Matrix = Eigen::Matrix4d;

constexpr std::size_t kMostTriangles = 2'000'000;

// Buffers come from files alone, not from what never ends.
tinygltf::FsCallbacks beside_the_file() {
  tinygltf::FsCallbacks files{};
  files.FileExists = [](const std::string& name, void*) {
    return std::filesystem::is_regular_file(name);
  };
  files.ExpandFilePath = [](const std::string& name, void*) { return name; };
  files.ReadWholeFile = [](std::vector<unsigned char>* bytes, std::string* error,
                           const std::string& name, void*) {
    try {
      const std::string text = read_text(name);
      bytes->assign(text.begin(), text.end());
      return true;
    } catch (const Problem& problem) {
      *error += problem.what();
      return false;
    }
  };
  files.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&,
                            void*) { return false; };
  return files;
}

tinygltf::Model parse(const std::string& path, const std::string& bytes) {
  tinygltf::TinyGLTF parser;
  parser.SetFsCallbacks(beside_the_file());
  parser.SetImageLoader([](tinygltf::Image*, const int, std::string*, std::string*, int, int,
                           const unsigned char*, int, void*) { return true; },
                        nullptr);
  tinygltf::Model model;
  std::string error, warning;
  const std::string beside = std::filesystem::path(path).parent_path().string();
  const auto size = static_cast<unsigned>(bytes.size());
  bool done = false;
  try {
    done = bytes.starts_with("glTF")
               ? parser.LoadBinaryFromMemory(&model, &error, &warning,
                                             reinterpret_cast<const unsigned char*>(bytes.data()),
                                             size, beside)
               : parser.LoadASCIIFromString(&model, &error, &warning, bytes.data(), size, beside);
  } catch (const std::exception& failure) {  // of its JSON
    error = failure.what();
  }
  while (error.ends_with('\n') || error.ends_with('.')) error.pop_back();
  if (!done) throw malformed(path, "is no glTF file that can be read: " + error);
  return model;
}

template <class T>
double component(const unsigned char* bytes, bool normalized) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  if constexpr (std::is_integral_v<T>)
    if (normalized)
      return std::max(static_cast<double>(value) / std::numeric_limits<T>::max(), -1.0);
  return static_cast<double>(value);
}

double component(const unsigned char* bytes, int type, bool normalized) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return component<std::int8_t>(bytes, normalized);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return component<std::uint8_t>(bytes, normalized);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return component<std::int16_t>(bytes, normalized);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return component<std::uint16_t>(bytes, normalized);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return component<std::uint32_t>(bytes, normalized);
    default:
      return component<float>(bytes, normalized);
  }
}

class Reading {
 public:
  Reading(const std::string& path, tinygltf::Model model) : path_(path), model_(std::move(model)) {}

  ImportedMesh run() {
    for (const std::string& extension : model_.extensionsRequired)
      if (extension != "KHR_mesh_quantization" && extension != "KHR_texture_transform" &&
          !extension.starts_with("KHR_materials"))
        refuse(
            fmt::format("needs the extension {}, which weft does not read; export it without "
                        "compression",
                        extension));
    add_scene();
    if (mesh_.triangles.empty()) refuse("has no triangles");
    if (!faults_.empty()) {
      std::vector<Fault> shown;
      add_some(shown, faults_);
      throw mesh_problem(path_, shown);
    }
    mesh_.panels_by = "primitive";
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const { throw malformed(path_, why); }

  // Of a list, or a Problem.
  template <class T>
  const T& at(const std::vector<T>& list, int index, const char* what) const {
    if (index < 0 || static_cast<std::size_t>(index) >= list.size())
      refuse(fmt::format("has no {} {}", what, index));
    return list[static_cast<std::size_t>(index)];
  }

  void add_scene() {
    const Matrix still = Matrix::Identity();
    if (model_.scenes.empty()) {
      for (std::size_t i = 0; i < model_.meshes.size(); ++i) add_mesh(static_cast<int>(i), still);
      return;
    }
    const tinygltf::Scene& scene = at(model_.scenes, std::max(model_.defaultScene, 0), "scene");
    for (const int node : scene.nodes) add_node(node, still);
  }

  // Every node once: they are trees.
  void add_node(int index, const Matrix& parent) {
    const tinygltf::Node& node = at(model_.nodes, index, "node");
    if (++nodes_ > model_.nodes.size()) refuse("its nodes are no trees");
    const Matrix placed = parent * local(node);
    if (node.mesh >= 0) add_mesh(node.mesh, placed);
    if (node.skin >= 0)
      mesh_.notes.emplace_back("its skin is left out: points are where they are bound");
    for (const int child : node.children) add_node(child, placed);
  }

  static Matrix local(const tinygltf::Node& node) {
    if (node.matrix.size() == 16) return Eigen::Map<const Matrix>(node.matrix.data());
    Eigen::Affine3d result = Eigen::Affine3d::Identity();
    if (const auto& t = node.translation; t.size() == 3)
      result.translate(Vector3d(t[0], t[1], t[2]));
    if (const auto& q = node.rotation; q.size() == 4)
      result.rotate(Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized());
    if (const auto& s = node.scale; s.size() == 3) result.scale(Vector3d(s[0], s[1], s[2]));
    return result.matrix();
  }

  void add_mesh(int index, const Matrix& placed) {
    const tinygltf::Mesh& mesh = at(model_.meshes, index, "mesh");
    const std::string name = mesh.name.empty() ? fmt::format("mesh {}", index) : mesh.name;
    for (std::size_t i = 0; i < mesh.primitives.size(); ++i)
      add_primitive(mesh.primitives[i], name, mesh.primitives.size() > 1, static_cast<int>(i),
                    placed);
  }

  void add_primitive(const tinygltf::Primitive& primitive, const std::string& mesh, bool of_several,
                     int number, const Matrix& placed) {
    part_ = fmt::format("{}, primitive {}", mesh, number);
    const int mode = primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
    if (mode < TINYGLTF_MODE_TRIANGLES) {
      mesh_.notes.push_back(part_ + ": its points or lines are left out");
      return;
    }
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end()) refuse(part_ + " has no POSITION");
    const std::size_t first = mesh_.positions.size();
    const std::size_t count = add_points(position->second, placed);
    const auto flat = primitive.attributes.find("TEXCOORD_0");
    const std::size_t first_flat = mesh_.flat.size();
    const bool has_flat = flat != primitive.attributes.end();
    if (has_flat && add_flat(flat->second) != count)
      refuse(part_ + ": TEXCOORD_0 and POSITION have different counts");

    std::vector<int> corners = corners_of(primitive, count);
    const bool mirrored = placed.topLeftCorner<3, 3>().determinant() < 0;
    const int panel = add_panel(mesh_, panel_name(primitive, mesh, of_several));
    mesh_.parts.push_back(part_);
    int face = 0;
    for (auto triangle : triangles_of(corners, mode)) {
      ++face;
      if (mirrored) std::swap(triangle[1], triangle[2]);
      std::array<int, 3> particles{}, places{};
      for (std::size_t k = 0; k < 3; ++k) {
        particles[k] = static_cast<int>(first) + triangle[k];
        places[k] = has_flat ? static_cast<int>(first_flat) + triangle[k] : kNoCorner;
      }
      mesh_.triangles.push_back(particles);
      mesh_.corners.push_back(places);
      mesh_.panel.push_back(panel);
      mesh_.source.push_back({static_cast<int>(mesh_.parts.size()) - 1, face, 0});
    }
    if (mesh_.triangles.size() > kMostTriangles)
      refuse(fmt::format("has more than {} triangles", kMostTriangles));
  }

  std::string panel_name(const tinygltf::Primitive& primitive, const std::string& mesh,
                         bool of_several) const {
    if (!of_several || primitive.material < 0) return mesh;
    const std::string& material = at(model_.materials, primitive.material, "material").name;
    return material.empty() ? mesh : material;
  }

  std::size_t add_points(int accessor, const Matrix& placed) {
    const std::size_t before = mesh_.positions.size();
    read(accessor, 3, "POSITION", [&](const Vector3d& value) {
      mesh_.positions.emplace_back((placed * value.homogeneous()).head<3>());
    });
    return mesh_.positions.size() - before;
  }

  std::size_t add_flat(int accessor) {
    const std::size_t before = mesh_.flat.size();
    read(accessor, 2, "TEXCOORD_0",
         [&](const Vector3d& value) { mesh_.flat.emplace_back(value.x(), 1 - value.y()); });
    return mesh_.flat.size() - before;
  }

  std::vector<int> corners_of(const tinygltf::Primitive& primitive, std::size_t count) {
    std::vector<int> corners;
    if (primitive.indices < 0) {
      for (std::size_t i = 0; i < count; ++i) corners.push_back(static_cast<int>(i));
      return corners;
    }
    read(primitive.indices, 1, "index", [&](const Vector3d& value) {
      if (!(value.x() >= 0 && value.x() < static_cast<double>(count)))
        refuse(fmt::format("{}: index {} is not one of its {} points", part_, value.x(), count));
      corners.push_back(static_cast<int>(value.x()));
    });
    return corners;
  }

  static Triangles triangles_of(const std::vector<int>& corners, int mode) {
    Triangles triangles;
    if (mode == TINYGLTF_MODE_TRIANGLES) {
      for (std::size_t i = 0; i + 2 < corners.size(); i += 3)
        triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
      return triangles;
    }
    for (std::size_t i = 2; i < corners.size(); ++i) {
      if (mode == TINYGLTF_MODE_TRIANGLE_FAN)
        triangles.push_back({corners[0], corners[i - 1], corners[i]});
      else if (i % 2 == 0)
        triangles.push_back({corners[i - 2], corners[i - 1], corners[i]});
      else
        triangles.push_back({corners[i - 1], corners[i - 2], corners[i]});
    }
    return triangles;
  }

  // Gives every element to `add`, its components first.
  template <class Add>
  void read(int index, int components, const char* what, const Add& add) {
    const tinygltf::Accessor& accessor = at(model_.accessors, index, "accessor");
    const std::string name = fmt::format("{}: accessor {} ({})", part_, index, what);
    if (accessor.sparse.isSparse) refuse(name + " is sparse, which weft does not read");
    if (tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)) != components)
      refuse(name + " has another number of components");
    const tinygltf::BufferView& view = at(model_.bufferViews, accessor.bufferView, "bufferView");
    const auto& bytes = at(model_.buffers, view.buffer, "buffer").data;
    const int width =
        tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType));
    if (width < 1 || width > 4 || accessor.componentType == TINYGLTF_COMPONENT_TYPE_INT)
      refuse(name + " has no such component type");
    const std::size_t size = static_cast<std::size_t>(width * components);
    const std::size_t stride = view.byteStride == 0 ? size : view.byteStride;
    if (!fits(accessor, view, size, stride, bytes.size()))
      refuse(name + " reaches beyond its buffer");

    const unsigned char* element = bytes.data() + view.byteOffset + accessor.byteOffset;
    for (std::size_t i = 0; i < accessor.count; ++i, element += i < accessor.count ? stride : 0) {
      Vector3d value = Vector3d::Zero();
      for (int k = 0; k < components; ++k)
        value[k] = component(element + k * width, accessor.componentType, accessor.normalized);
      if (!value.allFinite()) {
        faults_.push_back(
            {fmt::format("{}, point {}", part_, i), fmt::format("its {} is not finite", what)});
        value.setZero();
      }
      add(value);
    }
  }

  static bool fits(const tinygltf::Accessor& accessor, const tinygltf::BufferView& view,
                   std::size_t size, std::size_t stride, std::size_t bytes) {
    if (accessor.count == 0) return true;
    const std::size_t begin = view.byteOffset + accessor.byteOffset;
    return view.byteOffset <= bytes && accessor.byteOffset <= bytes && begin <= bytes &&
           size <= bytes - begin && (accessor.count - 1) <= (bytes - begin - size) / stride;
  }

  const std::string& path_;
  tinygltf::Model model_;
  ImportedMesh mesh_;
  std::string part_;
  std::size_t nodes_ = 0;
  std::vector<Fault> faults_;
};

}  // namespace

ImportedMesh read_gltf(const std::string& path, const std::string& bytes) {
  return Reading(path, parse(path, bytes)).run();
}

}  // namespace weft::client

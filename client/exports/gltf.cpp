#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <string_view>
#include <utility>

#include "client/exports/faces.h"
#include "client/exports/frame_writer.h"
#include "client/exports/normals.h"
#include "client/exports/output_file.h"
#include "client/output/json.h"
#include "client/problem.h"

namespace weft::client {
namespace {

constexpr std::size_t kMostFrames = 1000;                   // every one is a morph target
constexpr int kFloat = 5126, kUnsignedInt = 5125;           // componentType
constexpr int kVertices = 34962, kIndices = 34963;          // target of a bufferView
constexpr std::uint32_t kMagic = 0x46546c67, kVersion = 2;  // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4e4f534a, kBinChunk = 0x004e4942;
constexpr std::size_t kLongestNumber = 24;  // of JSON

using Vectors = std::vector<std::array<float, 3>>;

struct Bounds {
  std::array<float, 3> low{}, high{};
};

Vectors positions_of(const Points& points) {
  Vectors positions(points.x.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    positions[i] = {static_cast<float>(points.x[i]), static_cast<float>(points.y[i]),
                    static_cast<float>(points.z[i])};
  }
  return positions;
}

Vectors difference(const Vectors& a, const Vectors& b) {
  Vectors result(a.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) result[i][axis] = a[i][axis] - b[i][axis];
  return result;
}

Bounds bounds_of(const Vectors& vectors) {
  Bounds bounds{vectors.front(), vectors.front()};
  for (const auto& vector : vectors) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      bounds.low[axis] = std::min(bounds.low[axis], vector[axis]);
      bounds.high[axis] = std::max(bounds.high[axis], vector[axis]);
    }
  }
  return bounds;
}

// Triangles cut out of one piece, as indices of vertices.
struct Primitive {
  std::string panel;  // empty: it is not said
  std::vector<std::uint32_t> indices;
};

// What is drawn. Grids alone are one primitive whose vertices are the particles; panels have
// vertices of their own where corners of the flat shape differ.
struct Drawing {
  explicit Drawing(const std::vector<SheetMesh>& sheets) {
    const bool with_panels = have_panels(sheets);
    if (!with_panels) primitives.emplace_back();
    for (const SheetMesh& sheet : sheets) {
      const Faces faces = faces_of(sheet);
      const auto in_sheet = triangles_of(faces);
      triangles.insert(triangles.end(), in_sheet.begin(), in_sheet.end());
      if (!with_panels) {
        for (std::size_t i = 0; i < particle_count(sheet.layout); ++i)
          particles.push_back(static_cast<std::uint32_t>(particles.size()));
        continue;
      }
      Faces corners = faces;
      corners.particles = faces.flat;
      add_panels(sheet, in_sheet, triangles_of(corners));
    }
    if (!with_panels) primitives[0].indices = triangles;
  }

  std::size_t index_count() const { return triangles.size(); }
  bool has_flat_shape() const { return !flat.empty(); }

  std::vector<std::uint32_t> particles;    // of each vertex
  std::vector<std::array<float, 2>> flat;  // of each vertex, where panels are told
  std::vector<Primitive> primitives;       // with all triangles
  std::vector<std::uint32_t> triangles;    // the same, as particles

 private:
  void add_panels(const SheetMesh& sheet, const std::vector<std::uint32_t>& in_space,
                  const std::vector<std::uint32_t>& in_flat) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> vertices;
    for (const PanelRun& panel : sheet.panels) {
      Primitive& primitive = primitives.emplace_back();
      primitive.panel = panel.name;
      for (std::size_t i = 3 * panel.first; i < 3 * (panel.first + panel.count); ++i) {
        const auto next = static_cast<std::uint32_t>(particles.size());
        const auto [vertex, added] = vertices.try_emplace({in_space[i], in_flat[i]}, next);
        primitive.indices.push_back(vertex->second);
        if (!added) continue;
        particles.push_back(in_space[i]);
        const auto& [u, v] = sheet.flat[in_flat[i]];
        flat.push_back({u, 1 - v});  // of textures v runs down
      }
    }
  }
};

Vectors at_vertices(const Vectors& of_particles, const std::vector<std::uint32_t>& particles) {
  Vectors result(particles.size());
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = of_particles[particles[i]];
  return result;
}

// The file's JSON comes before the arrays that it describes, so room is left for it: its length is
// known but for the digits of the bounds.
class GltfWriter : public FrameWriter {
 public:
  GltfWriter(const std::string& path, Drawing drawing, std::size_t frames,
             const std::vector<std::string>& values)
      : file_(path), drawing_(std::move(drawing)), bounds_(frames) {
    if (frames == 1) values_ = values;
    json_room_ = json_text().size() + frames * 6 * kLongestNumber;
    json_room_ += (4 - json_room_ % 4) % 4;
    file_.write(std::string(20 + json_room_ + 8, ' '));
    for (const Primitive& primitive : drawing_.primitives) file_.write(bytes_of(primitive.indices));
    if (!drawing_.has_flat_shape()) return;
    file_.write(bytes_of(drawing_.flat));
    file_.write(bytes_of(std::vector<float>(drawing_.particles.begin(), drawing_.particles.end())));
  }

  void add(const ExportFrame& frame) override {
    if (times_.empty()) start_ = frame.time_s;
    const auto time = static_cast<float>(frame.time_s - start_);
    if (!times_.empty() && time <= times_.back())
      throw usage_problem("--times: those of an animation increase");
    Vectors positions = at_vertices(positions_of(frame.points), drawing_.particles);
    Vectors normals = at_vertices(normals_of(frame.points, drawing_.triangles), drawing_.particles);
    if (times_.empty()) {
      base_positions_ = positions;
      base_normals_ = normals;
    } else {
      positions = difference(positions, base_positions_);
      normals = difference(normals, base_normals_);
    }
    bounds_[times_.size()] = bounds_of(positions);
    times_.push_back(time);
    file_.write(bytes_of(positions));
    file_.write(bytes_of(normals));
    if (values_.empty()) return;
    for (const ExportValues& each : frame.values) {
      std::vector<float> values;
      for (const std::uint32_t i : drawing_.particles)
        values.push_back(static_cast<float>(each.values[i]));
      file_.write(bytes_of(values));
    }
  }

  void finish() override {
    if (bounds_.size() > 1) {
      file_.write(bytes_of(times_));
      std::vector<float> weights(bounds_.size() - 1);
      for (std::size_t frame = 0; frame < bounds_.size(); ++frame) {
        std::fill(weights.begin(), weights.end(), 0.0F);
        if (frame > 0) weights[frame - 1] = 1;
        file_.write(bytes_of(weights));
      }
    }
    std::string json = json_text();
    json.resize(json_room_, ' ');
    const auto json_bytes = static_cast<std::uint32_t>(json.size());
    const auto binary_bytes = static_cast<std::uint32_t>(binary_size());
    file_.seek(0);
    file_.write(bytes_of(
        std::vector{kMagic, kVersion, 28 + json_bytes + binary_bytes, json_bytes, kJsonChunk}));
    file_.write(json);
    file_.write(bytes_of(std::vector{binary_bytes, kBinChunk}));
    file_.close();
  }

  static void check(const Drawing& drawing, std::size_t frames) {
    const std::size_t particles = drawing.particles.size();
    const std::size_t bytes =
        4 * drawing.index_count() + (20 + 24 * frames) * particles + 4 * frames * frames;
    if (frames > kMostFrames || bytes > std::numeric_limits<std::uint32_t>::max() / 2) {
      throw usage_problem(fmt::format(
          "{} frames of {} particles are too much for glTF, which takes {} frames and 2 GiB: "
          "choose with --frames or --every",
          frames, particles, kMostFrames));
    }
  }

 private:
  std::size_t binary_size() const {
    const std::size_t frames = bounds_.size();
    const std::size_t vertices = drawing_.particles.size();
    return 4 * drawing_.index_count() + (drawing_.has_flat_shape() ? 12 * vertices : 0) +
           (24 * frames + 4 * values_.size()) * vertices + (frames > 1 ? 4 * frames * frames : 0);
  }

  // One view of the binary chunk for every array, in the order in which they are written.
  struct Arrays {
    Json views = Json::array();
    Json accessors = Json::array();
    std::size_t bytes = 0;

    std::size_t add(int type, const char* shape, std::size_t components, std::size_t count,
                    int target) {
      Json view{{"buffer", 0}, {"byteOffset", bytes}, {"byteLength", 4 * components * count}};
      if (target != 0) view["target"] = target;
      accessors.push_back({{"bufferView", views.size()},
                           {"componentType", type},
                           {"count", count},
                           {"type", shape}});
      views.push_back(std::move(view));
      bytes += 4 * components * count;
      return accessors.size() - 1;
    }
  };

  std::string json_text() const {
    const std::size_t frames = bounds_.size();
    Arrays arrays;
    const std::size_t vertices = drawing_.particles.size();
    std::vector<std::size_t> indices;
    for (const Primitive& primitive : drawing_.primitives)
      indices.push_back(arrays.add(kUnsignedInt, "SCALAR", 1, primitive.indices.size(), kIndices));
    Json flat_shape = Json::object();
    if (drawing_.has_flat_shape()) {
      flat_shape["TEXCOORD_0"] = arrays.add(kFloat, "VEC2", 2, vertices, kVertices);
      flat_shape["_PARTICLE"] = arrays.add(kFloat, "SCALAR", 1, vertices, kVertices);
    }
    Json shapes = Json::array();
    for (const Bounds& bounds : bounds_) {
      const std::size_t positions = arrays.add(kFloat, "VEC3", 3, vertices, kVertices);
      arrays.accessors[positions]["min"] = bounds.low;
      arrays.accessors[positions]["max"] = bounds.high;
      const std::size_t normals = arrays.add(kFloat, "VEC3", 3, vertices, kVertices);
      shapes.push_back({{"POSITION", positions}, {"NORMAL", normals}});
    }
    Json attributes = shapes[0];
    attributes.update(flat_shape);
    for (const std::string& name : values_)
      attributes[attribute_of(name)] = arrays.add(kFloat, "SCALAR", 1, vertices, kVertices);
    // a material for each panel: what tools that join primitives tell them apart by
    Json primitives = Json::array(), materials = Json::array();
    for (std::size_t i = 0; i < indices.size(); ++i) {
      primitives.push_back({{"attributes", attributes}, {"indices", indices[i]}, {"material", i}});
      const std::string& panel = drawing_.primitives[i].panel;
      materials.push_back({{"name", panel.empty() ? "cloth" : panel},
                           {"doubleSided", true},
                           {"pbrMetallicRoughness",
                            {{"baseColorFactor", {0.6, 0.1, 0.05, 1}},
                             {"metallicFactor", 0},
                             {"roughnessFactor", 0.9}}}});
      if (!panel.empty()) primitives.back()["extras"] = {{"panel", panel}};
    }
    Json json{{"asset", {{"version", "2.0"}, {"generator", "weft " WEFT_VERSION}}},
              {"scene", 0},
              {"scenes", {{{"nodes", {0}}}}},
              {"nodes", {{{"mesh", 0}, {"name", "cloth"}}}},
              {"materials", std::move(materials)}};
    if (frames > 1) {
      shapes.erase(0);
      for (Json& primitive : primitives) primitive["targets"] = shapes;
      const std::size_t times = arrays.add(kFloat, "SCALAR", 1, frames, 0);
      arrays.accessors[times]["min"] = {times_.empty() ? 0.0F : times_.front()};
      arrays.accessors[times]["max"] = {times_.empty() ? 0.0F : times_.back()};
      const std::size_t weights = arrays.add(kFloat, "SCALAR", 1, frames * (frames - 1), 0);
      json["animations"] = {
          {{"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}}}},
           {"samplers", {{{"input", times}, {"output", weights}, {"interpolation", "LINEAR"}}}}}};
    }
    json["meshes"] = {{{"primitives", std::move(primitives)}}};
    json["buffers"] = {{{"byteLength", arrays.bytes}}};
    json["bufferViews"] = std::move(arrays.views);
    json["accessors"] = std::move(arrays.accessors);
    return json.dump();
  }

  // Of an application: "pressure" -> "_PRESSURE".
  static std::string attribute_of(const std::string& name) {
    std::string attribute = "_";
    for (const char letter : name)
      attribute += static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
    return attribute;
  }

  OutputFile file_;
  Drawing drawing_;
  std::vector<std::string> values_;  // names of those that are written
  std::vector<Bounds> bounds_;       // of every frame's positions
  std::vector<float> times_;         // from the first frame on, s
  double start_ = 0;                 // s
  Vectors base_positions_;           // of the first frame
  Vectors base_normals_;
  std::size_t json_room_ = 0;
};

}  // namespace

std::unique_ptr<FrameWriter> make_gltf_writer(const std::string& path,
                                              const std::vector<SheetMesh>& sheets,
                                              std::size_t frames,
                                              const std::vector<std::string>& values) {
  Drawing drawing(sheets);
  GltfWriter::check(drawing, frames);
  return std::make_unique<GltfWriter>(path, std::move(drawing), frames, values);
}

}  // namespace weft::client

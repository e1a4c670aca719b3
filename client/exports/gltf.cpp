#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>

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

// The file's JSON comes before the arrays that it describes, so room is left for it: its length is
// known but for the digits of the bounds.
class GltfWriter : public FrameWriter {
 public:
  GltfWriter(const std::string& path, const std::vector<v1::SheetLayout>& sheets,
             std::size_t particles, std::size_t frames)
      : file_(path), particles_(particles), triangles_(triangles_of(sheets)), bounds_(frames) {
    json_room_ = json_text().size() + frames * 6 * kLongestNumber;
    json_room_ += (4 - json_room_ % 4) % 4;
    file_.write(std::string(20 + json_room_ + 8, ' '));
    file_.write(bytes_of(triangles_));
  }

  void add(const ExportFrame& frame) override {
    if (times_.empty()) start_ = frame.time_s;
    const auto time = static_cast<float>(frame.time_s - start_);
    if (!times_.empty() && time <= times_.back())
      throw usage_problem("--times: those of an animation increase");
    Vectors positions = positions_of(frame.points);
    Vectors normals = normals_of(frame.points, triangles_);
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

  static void check(std::size_t particles, std::size_t cells, std::size_t frames) {
    const std::size_t bytes = 24 * (cells + particles * frames) + 4 * frames * frames;
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
    return 4 * triangles_.size() + 24 * particles_ * frames +
           (frames > 1 ? 4 * frames * frames : 0);
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
    const std::size_t indices = arrays.add(kUnsignedInt, "SCALAR", 1, triangles_.size(), kIndices);
    Json shapes = Json::array();
    for (const Bounds& bounds : bounds_) {
      const std::size_t positions = arrays.add(kFloat, "VEC3", 3, particles_, kVertices);
      arrays.accessors[positions]["min"] = bounds.low;
      arrays.accessors[positions]["max"] = bounds.high;
      const std::size_t normals = arrays.add(kFloat, "VEC3", 3, particles_, kVertices);
      shapes.push_back({{"POSITION", positions}, {"NORMAL", normals}});
    }
    Json mesh{{"attributes", shapes[0]}, {"indices", indices}, {"material", 0}};
    Json json{{"asset", {{"version", "2.0"}, {"generator", "weft " WEFT_VERSION}}},
              {"scene", 0},
              {"scenes", {{{"nodes", {0}}}}},
              {"nodes", {{{"mesh", 0}, {"name", "cloth"}}}},
              {"materials",
               {{{"doubleSided", true},
                 {"pbrMetallicRoughness",
                  {{"baseColorFactor", {0.6, 0.1, 0.05, 1}},
                   {"metallicFactor", 0},
                   {"roughnessFactor", 0.9}}}}}}};
    if (frames > 1) {
      shapes.erase(0);
      mesh["targets"] = std::move(shapes);
      const std::size_t times = arrays.add(kFloat, "SCALAR", 1, frames, 0);
      arrays.accessors[times]["min"] = {times_.empty() ? 0.0F : times_.front()};
      arrays.accessors[times]["max"] = {times_.empty() ? 0.0F : times_.back()};
      const std::size_t weights = arrays.add(kFloat, "SCALAR", 1, frames * (frames - 1), 0);
      json["animations"] = {
          {{"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}}}},
           {"samplers", {{{"input", times}, {"output", weights}, {"interpolation", "LINEAR"}}}}}};
    }
    json["meshes"] = {{{"primitives", {std::move(mesh)}}}};
    json["buffers"] = {{{"byteLength", arrays.bytes}}};
    json["bufferViews"] = std::move(arrays.views);
    json["accessors"] = std::move(arrays.accessors);
    return json.dump();
  }

  OutputFile file_;
  std::size_t particles_;
  std::vector<std::uint32_t> triangles_;
  std::vector<Bounds> bounds_;  // of every frame's positions
  std::vector<float> times_;    // from the first frame on, s
  double start_ = 0;            // s
  Vectors base_positions_;      // of the first frame
  Vectors base_normals_;
  std::size_t json_room_ = 0;
};

}  // namespace

std::unique_ptr<FrameWriter> make_gltf_writer(const std::string& path,
                                              const std::vector<v1::SheetLayout>& sheets,
                                              std::size_t particles, std::size_t frames) {
  std::size_t cells = 0;
  for (const auto& sheet : sheets) cells += quads_of(sheet).size();
  GltfWriter::check(particles, cells, frames);
  return std::make_unique<GltfWriter>(path, sheets, particles, frames);
}

}  // namespace weft::client

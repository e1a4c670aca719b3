#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <iterator>
#include <limits>
#include <set>

#include "client/exports/frame_writer.h"
#include "client/exports/output_file.h"
#include "client/problem.h"
#include "client/sheet_layout.h"

namespace weft::client {
namespace {

// An identifier of USD: "my-sheet" -> "my_sheet", "2" -> "_2".
std::string identifier(std::string name) {
  std::replace(name.begin(), name.end(), '-', '_');
  if (name[0] >= '0' && name[0] <= '9') name.insert(0, "_");
  return name;
}

template <class Numbers>
std::string list_of(const Numbers& numbers) {
  return fmt::format("[{}]", fmt::join(numbers, ", "));
}

class UsdWriter : public FrameWriter {
 public:
  UsdWriter(const std::string& path, const std::vector<v1::SheetLayout>& sheets,
            const UsdStage& stage)
      : file_(checked(path)) {
    file_.write(
        fmt::format("#usda 1.0\n(\n"
                    "    defaultPrim = \"cloth\"\n"
                    "    endTimeCode = {}\n"
                    "    framesPerSecond = {:.12g}\n"
                    "    metersPerUnit = 1\n"
                    "    startTimeCode = {}\n"
                    "    timeCodesPerSecond = {:.12g}\n"
                    "    upAxis = \"{}\"\n)\n\n",
                    stage.last_frame, stage.frames_per_second, stage.first_frame,
                    stage.frames_per_second, stage.up_axis));
    std::vector<std::int32_t> corners;
    std::set<std::string> names;
    for (const auto& sheet : sheets) {
      const std::size_t before = corners.size() / 4;
      for (const Quad& quad : quads_of(sheet))
        corners.insert(corners.end(), quad.begin(), quad.end());
      std::vector<std::size_t> faces(corners.size() / 4 - before);
      for (std::size_t i = 0; i < faces.size(); ++i) faces[i] = before + i;
      std::string name = identifier(sheet.name());
      while (!names.insert(name).second) name += '_';
      subsets_ += fmt::format(
          "\n    def GeomSubset \"{}\"\n    {{\n"
          "        uniform token elementType = \"face\"\n"
          "        uniform token familyName = \"sheets\"\n"
          "        int[] indices = {}\n    }}\n",
          name, list_of(faces));
    }
    file_.write(
        fmt::format("def Mesh \"cloth\"\n{{\n"
                    "    uniform bool doubleSided = 1\n"
                    "    uniform token subdivisionScheme = \"none\"\n"
                    "    int[] faceVertexCounts = {}\n"
                    "    int[] faceVertexIndices = {}\n"
                    "    point3f[] points.timeSamples = {{\n",
                    list_of(std::vector<int>(corners.size() / 4, 4)), list_of(corners)));
  }

  void add(const ExportFrame& frame) override {
    const std::array axes{&frame.points.x, &frame.points.y, &frame.points.z};
    std::array<float, 3> low{}, high{};
    low.fill(std::numeric_limits<float>::infinity());
    high.fill(-std::numeric_limits<float>::infinity());
    std::string text = fmt::format("        {}: [", frame.number);
    for (std::size_t i = 0; i < axes[0]->size(); ++i) {
      std::array<float, 3> point{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        point[axis] = static_cast<float>((*axes[axis])[i]);
        low[axis] = std::min(low[axis], point[axis]);
        high[axis] = std::max(high[axis], point[axis]);
      }
      fmt::format_to(std::back_inserter(text), "{}({})", i == 0 ? "" : ", ",
                     fmt::join(point, ", "));
    }
    file_.write(text + "],\n");
    fmt::format_to(std::back_inserter(extents_), "        {}: [({}), ({})],\n", frame.number,
                   fmt::join(low, ", "), fmt::join(high, ", "));
  }

  void finish() override {
    file_.write("    }\n    float3[] extent.timeSamples = {\n" + extents_ + "    }\n" + subsets_ +
                "}\n");
    file_.close();
  }

 private:
  static const std::string& checked(const std::string& path) {
    if (std::filesystem::path(path).extension() != ".usda")
      throw usage_problem("--output " + path + ": the name of USD text ends in .usda");
    return path;
  }

  OutputFile file_;
  std::string extents_;  // a line a frame
  std::string subsets_;
};

}  // namespace

std::unique_ptr<FrameWriter> make_usd_writer(const std::string& path,
                                             const std::vector<v1::SheetLayout>& sheets,
                                             const UsdStage& stage) {
  return std::make_unique<UsdWriter>(path, sheets, stage);
}

}  // namespace weft::client

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <iterator>
#include <limits>
#include <set>

#include "client/exports/faces.h"
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
  UsdWriter(const std::string& path, const std::vector<SheetMesh>& sheets, const UsdStage& stage)
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
    std::vector<std::int32_t> particles, counts;
    std::vector<std::array<float, 2>> corners;
    for (const SheetMesh& sheet : sheets) {
      const Faces faces = faces_of(sheet);
      const std::size_t before = counts.size();
      counts.insert(counts.end(), faces.count(), static_cast<std::int32_t>(faces.corners));
      particles.insert(particles.end(), faces.particles.begin(), faces.particles.end());
      add_subset("sheets", sheet.layout.name(), before, faces.count());
      if (!have_panels(sheets)) continue;
      for (const std::int32_t corner : faces.flat)
        corners.push_back(sheet.flat[static_cast<std::size_t>(corner)]);
      if (is_grid(sheet.layout)) continue;
      for (const PanelRun& panel : sheet.panels)
        add_subset("panels", sheet.layout.name() + '_' + panel.name, before + panel.first,
                   panel.count);
    }
    file_.write(
        fmt::format("def Mesh \"cloth\"\n{{\n"
                    "    uniform bool doubleSided = 1\n"
                    "    uniform token subdivisionScheme = \"none\"\n"
                    "    int[] faceVertexCounts = {}\n"
                    "    int[] faceVertexIndices = {}\n"
                    "{}"
                    "    point3f[] points.timeSamples = {{\n",
                    list_of(counts), list_of(particles), flat_text(corners)));
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

  void add_subset(const char* family, const std::string& title, std::size_t first,
                  std::size_t count) {
    std::vector<std::size_t> faces(count);
    for (std::size_t i = 0; i < count; ++i) faces[i] = first + i;
    std::string name = identifier(title);
    while (!names_.insert(name).second) name += '_';
    subsets_ += fmt::format(
        "\n    def GeomSubset \"{}\"\n    {{\n"
        "        uniform token elementType = \"face\"\n"
        "        uniform token familyName = \"{}\"\n"
        "        int[] indices = {}\n    }}\n",
        name, family, list_of(faces));
  }

  static std::string flat_text(const std::vector<std::array<float, 2>>& corners) {
    if (corners.empty()) return {};
    std::string text = "    texCoord2f[] primvars:st = [";
    for (std::size_t i = 0; i < corners.size(); ++i)
      fmt::format_to(std::back_inserter(text), "{}({})", i == 0 ? "" : ", ",
                     fmt::join(corners[i], ", "));
    return text + "] (\n        interpolation = \"faceVarying\"\n    )\n";
  }

  OutputFile file_;
  std::set<std::string> names_;  // of subsets
  std::string extents_;          // a line a frame
  std::string subsets_;
};

}  // namespace

std::unique_ptr<FrameWriter> make_usd_writer(const std::string& path,
                                             const std::vector<SheetMesh>& sheets,
                                             const UsdStage& stage) {
  return std::make_unique<UsdWriter>(path, sheets, stage);
}

}  // namespace weft::client

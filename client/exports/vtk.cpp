#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "client/exports/faces.h"
#include "client/exports/frame_writer.h"
#include "client/exports/output_file.h"
#include "client/problem.h"
#include "client/sheet_layout.h"

namespace weft::client {
namespace {

// The arrays of a .vtp file, which follow its XML as they are in memory, each after its length.
class Appended {
 public:
  // The XML of an array.
  std::string add(std::string_view type, std::string_view attributes, std::string_view bytes) {
    std::string element =
        fmt::format("<DataArray type=\"{}\" {} format=\"appended\" offset=\"{}\"/>\n", type,
                    attributes, bytes_.size());
    const std::uint64_t length = bytes.size();
    bytes_.append(reinterpret_cast<const char*>(&length), sizeof(length));
    bytes_ += bytes;
    return element;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

class VtkWriter : public FrameWriter {
 public:
  VtkWriter(const std::string& path, const std::vector<SheetMesh>& sheets)
      : directory_(directory_of(path)), collection_(path) {
    const bool with_panels = have_panels(sheets);
    for (const SheetMesh& sheet : sheets) {
      const Faces faces = faces_of(sheet);
      for (std::size_t face = 0; face < faces.count(); ++face) {
        const std::size_t first = face * faces.corners;
        for (std::size_t i = first; i < first + faces.corners; ++i)
          corners_.push_back(faces.particles[i]);
        ends_.push_back(static_cast<std::int32_t>(corners_.size()));
        if (!with_panels) continue;
        for (std::size_t k = 0; k < kMostCorners; ++k) {
          const std::size_t corner = first + std::min(k, faces.corners - 1);
          const auto& uv = sheet.flat[static_cast<std::size_t>(faces.flat[corner])];
          flat_.insert(flat_.end(), uv.begin(), uv.end());
        }
      }
      if (with_panels) add_panels(sheet, faces.count());
    }
    collection_.write(
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n"
        "<Collection>\n");
  }

  void add(const ExportFrame& frame) override {
    const std::string name = fmt::format("frame_{:06}.vtp", frame.number);
    OutputFile file((directory_ / name).string());
    file.write(mesh_text(frame));
    file.close();
    collection_.write(fmt::format("<DataSet timestep=\"{:.12g}\" part=\"0\" file=\"{}/{}\"/>\n",
                                  frame.time_s, directory_.filename().string(), name));
  }

  void finish() override {
    collection_.write("</Collection>\n</VTKFile>\n");
    collection_.close();
  }

 private:
  static std::filesystem::path directory_of(const std::filesystem::path& path) {
    if (path.extension() != ".pvd")
      throw usage_problem("--output " + path.string() + ": a collection's name ends in .pvd");
    std::filesystem::path directory = path;
    directory.replace_extension();
    std::error_code error;
    std::filesystem::create_directories(directory, error);
    if (error) throw unwritable(directory.string(), error.message());
    return directory;
  }

  static constexpr std::size_t kMostCorners = 4;

  void add_panels(const SheetMesh& sheet, std::size_t faces) {
    if (is_grid(sheet.layout)) panels_.insert(panels_.end(), faces, panel_++);
    for (const PanelRun& panel : sheet.panels)
      if (!is_grid(sheet.layout)) panels_.insert(panels_.end(), panel.count, panel_++);
  }

  std::string mesh_text(const ExportFrame& frame) const {
    const Points& points = frame.points;
    std::vector<double> values;
    values.reserve(3 * points.x.size());
    for (std::size_t i = 0; i < points.x.size(); ++i)
      values.insert(values.end(), {points.x[i], points.y[i], points.z[i]});
    Appended arrays;
    std::string text = fmt::format(
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
        "header_type=\"UInt64\">\n"
        "<PolyData>\n<Piece NumberOfPoints=\"{}\" NumberOfPolys=\"{}\">\n",
        points.x.size(), ends_.size());
    text += point_data(frame, arrays) + "<Points>\n" +
            arrays.add("Float64", "NumberOfComponents=\"3\"", bytes_of(values)) +
            "</Points>\n<Polys>\n" +
            arrays.add("Int32", "Name=\"connectivity\"", bytes_of(corners_)) +
            arrays.add("Int32", "Name=\"offsets\"", bytes_of(ends_)) + "</Polys>\n" +
            cell_data(arrays) + "</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">_";
    return text + arrays.bytes() + "</AppendedData>\n</VTKFile>\n";
  }

  static std::string point_data(const ExportFrame& frame, Appended& arrays) {
    if (frame.values.empty()) return {};
    std::string text = "<PointData>\n";
    for (const auto& [name, values] : frame.values)
      text += arrays.add("Float64", fmt::format("Name=\"{}\"", name), bytes_of(values));
    return text + "</PointData>\n";
  }

  // Where there are panels; the last corner of a triangle stands twice.
  std::string cell_data(Appended& arrays) const {
    if (panels_.empty()) return {};
    return "<CellData>\n" + arrays.add("Int32", "Name=\"panel\"", bytes_of(panels_)) +
           arrays.add("Float32", "Name=\"uv\" NumberOfComponents=\"8\"", bytes_of(flat_)) +
           "</CellData>\n";
  }

  std::filesystem::path directory_;
  OutputFile collection_;
  std::vector<std::int32_t> corners_;
  std::vector<std::int32_t> ends_;    // of each cell in corners_
  std::vector<std::int32_t> panels_;  // of each cell
  std::int32_t panel_ = 0;            // so many so far
  std::vector<float> flat_;           // u and v of kMostCorners of each cell, m
};

}  // namespace

std::unique_ptr<FrameWriter> make_vtk_writer(const std::string& path,
                                             const std::vector<SheetMesh>& sheets) {
  return std::make_unique<VtkWriter>(path, sheets);
}

}  // namespace weft::client

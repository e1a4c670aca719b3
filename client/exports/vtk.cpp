#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <system_error>

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
  VtkWriter(const std::string& path, const std::vector<v1::SheetLayout>& sheets)
      : directory_(directory_of(path)), collection_(path) {
    for (const auto& sheet : sheets) {
      for (const Quad& quad : quads_of(sheet)) {
        corners_.insert(corners_.end(), quad.begin(), quad.end());
        ends_.push_back(static_cast<std::int32_t>(corners_.size()));
      }
    }
    collection_.write(
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n"
        "<Collection>\n");
  }

  void add(const ExportFrame& frame) override {
    const std::string name = fmt::format("frame_{:06}.vtp", frame.number);
    OutputFile file((directory_ / name).string());
    file.write(mesh_text(frame.points));
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

  std::string mesh_text(const Points& points) const {
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
    text += "<Points>\n" + arrays.add("Float64", "NumberOfComponents=\"3\"", bytes_of(values)) +
            "</Points>\n<Polys>\n" +
            arrays.add("Int32", "Name=\"connectivity\"", bytes_of(corners_)) +
            arrays.add("Int32", "Name=\"offsets\"", bytes_of(ends_)) +
            "</Polys>\n</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">_";
    return text + arrays.bytes() + "</AppendedData>\n</VTKFile>\n";
  }

  std::filesystem::path directory_;
  OutputFile collection_;
  std::vector<std::int32_t> corners_;
  std::vector<std::int32_t> ends_;  // of each cell in corners_
};

}  // namespace

std::unique_ptr<FrameWriter> make_vtk_writer(const std::string& path,
                                             const std::vector<v1::SheetLayout>& sheets) {
  return std::make_unique<VtkWriter>(path, sheets);
}

}  // namespace weft::client

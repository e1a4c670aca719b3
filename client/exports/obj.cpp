#include <fmt/format.h>

#include <filesystem>
#include <iterator>
#include <system_error>

#include "client/exports/frame_writer.h"
#include "client/exports/output_file.h"
#include "client/problem.h"
#include "client/sheet_layout.h"

namespace weft::client {
namespace {

void add_vertices(std::string& text, const Points& points, std::size_t first, std::size_t count) {
  for (std::size_t i = first; i < first + count; ++i) {
    fmt::format_to(std::back_inserter(text), "v {:.9g} {:.9g} {:.9g}\n", points.x[i], points.y[i],
                   points.z[i]);
  }
}

// OBJ counts vertices from 1.
void add_quads(std::string& text, const v1::SheetLayout& sheet) {
  for (const auto& [a, b, c, d] : quads_of(sheet))
    fmt::format_to(std::back_inserter(text), "f {} {} {} {}\n", a + 1, b + 1, c + 1, d + 1);
}

class ObjWriter : public FrameWriter {
 public:
  ObjWriter(const std::string& directory, std::vector<v1::SheetLayout> sheets)
      : directory_(directory), sheets_(std::move(sheets)) {
    std::error_code error;
    std::filesystem::create_directories(directory_, error);
    if (error) throw unwritable(directory, error.message());
  }

  void add(const ExportFrame& frame) override {
    std::string text;
    for (const auto& sheet : sheets_) {
      text += "o " + sheet.name() + '\n';
      add_vertices(text, frame.points, static_cast<std::size_t>(sheet.first_particle()),
                   particle_count(sheet));
      add_quads(text, sheet);
    }
    OutputFile file(directory_ / fmt::format("cloth_{:06}.obj", frame.number));
    file.write(text);
    file.close();
  }

  void finish() override {}

 private:
  std::filesystem::path directory_;
  std::vector<v1::SheetLayout> sheets_;
};

}  // namespace

std::unique_ptr<FrameWriter> make_obj_writer(const std::string& directory,
                                             std::vector<v1::SheetLayout> sheets) {
  return std::make_unique<ObjWriter>(directory, std::move(sheets));
}

}  // namespace weft::client

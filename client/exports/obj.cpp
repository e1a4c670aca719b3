#include <fmt/format.h>

#include <filesystem>
#include <iterator>
#include <system_error>

#include "client/exports/faces.h"
#include "client/exports/frame_writer.h"
#include "client/exports/normals.h"
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

// How many there are before the sheet, in all sheets.
struct Before {
  std::size_t corners = 0, normals = 0;
};

void add_triangles(std::string& text, const SheetMesh& sheet, const Points& points,
                   Before& before) {
  for (const auto& [u, v] : sheet.flat)
    fmt::format_to(std::back_inserter(text), "vt {:.9g} {:.9g}\n", u, v);
  const auto first = static_cast<std::size_t>(sheet.layout.first_particle());
  const std::size_t count = particle_count(sheet.layout);
  const auto normals = normals_of(points, triangles_of(faces_of(sheet)));
  for (std::size_t i = first; i < first + count; ++i)
    fmt::format_to(std::back_inserter(text), "vn {:.6g}\n", fmt::join(normals[i], " "));
  for (const PanelRun& panel : sheet.panels) {
    text += "g " + panel.name + "\nusemtl " + panel.name + '\n';
    for (std::size_t t = panel.first; t < panel.first + panel.count; ++t) {
      text += 'f';
      for (std::size_t k = 0; k < 3; ++k) {
        const auto particle = static_cast<std::size_t>(sheet.triangles[t][k]);
        const auto corner = static_cast<std::size_t>(sheet.flat_triangles[t][k]);
        fmt::format_to(std::back_inserter(text), " {}/{}/{}", first + particle + 1,
                       before.corners + corner + 1, before.normals + particle + 1);
      }
      text += '\n';
    }
  }
  before.corners += sheet.flat.size();
  before.normals += count;
}

class ObjWriter : public FrameWriter {
 public:
  ObjWriter(const std::string& directory, std::vector<SheetMesh> sheets)
      : directory_(directory), sheets_(std::move(sheets)) {
    std::error_code error;
    std::filesystem::create_directories(directory_, error);
    if (error) throw unwritable(directory, error.message());
  }

  void add(const ExportFrame& frame) override {
    std::string text;
    Before before;
    for (const SheetMesh& sheet : sheets_) {
      text += "o " + sheet.layout.name() + '\n';
      add_vertices(text, frame.points, static_cast<std::size_t>(sheet.layout.first_particle()),
                   particle_count(sheet.layout));
      if (!is_grid(sheet.layout)) {
        add_triangles(text, sheet, frame.points, before);
        continue;
      }
      if (before.corners > 0) text += "g " + sheet.layout.name() + '\n';
      add_quads(text, sheet.layout);
    }
    OutputFile file(directory_ / fmt::format("cloth_{:06}.obj", frame.number));
    file.write(text);
    file.close();
  }

  void finish() override {}

 private:
  std::filesystem::path directory_;
  std::vector<SheetMesh> sheets_;
};

}  // namespace

std::unique_ptr<FrameWriter> make_obj_writer(const std::string& directory,
                                             std::vector<SheetMesh> sheets) {
  return std::make_unique<ObjWriter>(directory, std::move(sheets));
}

}  // namespace weft::client

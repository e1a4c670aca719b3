#include "client/sheet_layout.h"

#include <fmt/format.h>

namespace weft::client {

bool is_sound(const v1::SheetLayout& sheet) { return sheet.rows() > 0 && sheet.columns() > 0; }

std::size_t particle_count(const v1::SheetLayout& sheet) {
  return static_cast<std::size_t>(sheet.rows()) * static_cast<std::size_t>(sheet.columns());
}

std::string shape_text(const v1::SheetLayout& sheet) {
  return fmt::format("{} x {} particles", sheet.rows(), sheet.columns());
}

std::vector<Quad> quads_of(const v1::SheetLayout& sheet) {
  std::vector<Quad> quads;
  for (int row = 0; row + 1 < sheet.rows(); ++row) {
    for (int column = 0; column + 1 < sheet.columns(); ++column) {
      const int corner = sheet.first_particle() + row * sheet.columns() + column;
      const int below = corner + sheet.columns();
      quads.push_back({corner, below, below + 1, corner + 1});
    }
  }
  return quads;
}

std::vector<std::uint32_t> triangles_of(const std::vector<v1::SheetLayout>& sheets) {
  std::vector<std::uint32_t> triangles;
  for (const auto& sheet : sheets) {
    for (const Quad& quad : quads_of(sheet)) {
      for (const std::size_t corner : {0U, 1U, 2U, 0U, 2U, 3U})
        triangles.push_back(static_cast<std::uint32_t>(quad[corner]));
    }
  }
  return triangles;
}

GridPlace place_in(const v1::SheetLayout& sheet, int particle) {
  return {particle / sheet.columns(), particle % sheet.columns()};
}

}  // namespace weft::client

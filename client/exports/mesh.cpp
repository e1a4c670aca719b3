#include "client/exports/mesh.h"

namespace weft::client {

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

}  // namespace weft::client

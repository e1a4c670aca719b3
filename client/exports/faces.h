#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "client/sheet_layout.h"

namespace weft::client {

// The faces of a sheet as they are exported: the cells of a grid, else its triangles.
struct Faces {
  std::size_t corners = 3;              // of each
  std::vector<std::int32_t> particles;  // of all faces, counted from the first exported
  std::vector<std::int32_t> flat;       // their corners of the flat shape

  std::size_t count() const { return particles.size() / corners; }
};
Faces faces_of(const SheetMesh& sheet);

// Whether exports say panels and the flat shape: those of grids alone leave them out.
bool have_panels(const std::vector<SheetMesh>& sheets);

// Particles of the triangles; cells are cut in two.
std::vector<std::uint32_t> triangles_of(const Faces& faces);

}  // namespace weft::client

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "weft/v1/frame.pb.h"
#include "weft/v1/scene.pb.h"

// What a stream's header and its topology say of a sheet's particles. Who reads, exports or draws
// frames asks here, not for the sheet's shape.
namespace weft::client {

// Precondition of all others: the layout is sound.
bool is_sound(const v1::SheetLayout& sheet);

// Of rows and columns; any other is of triangles that the topology tells.
bool is_grid(const v1::SheetLayout& sheet);

// Whether the frames of the scene need a topology to be understood.
bool needs_topology(const v1::Scene& scene);
bool needs_topology(const v1::StreamHeader& header);

std::size_t particle_count(const v1::SheetLayout& sheet);
std::size_t triangle_count(const v1::SheetLayout& sheet);

// ", each 4. row and column simulated" of a grid that frames interpolate; else nothing.
std::string simulated_text(int every);
// "31 x 31 particles", "3546 particles, 6890 triangles"
std::string shape_text(const v1::SheetLayout& sheet);

// The corners of a cell.
using Quad = std::array<std::int32_t, 4>;

// The cells of a grid, row by row, seen from above a flat sheet anticlockwise.
std::vector<Quad> quads_of(const v1::SheetLayout& sheet);

// Two triangles of each cell of grids, as indices of their corners.
std::vector<std::uint32_t> triangles_of(const std::vector<v1::SheetLayout>& sheets);

// Where a particle of a grid lies, counted from the sheet's first.
struct GridPlace {
  int row = 0;
  int column = 0;
};
GridPlace place_in(const v1::SheetLayout& sheet, int particle);

// A mesh of every sheet, as streamed; that of a grid may be empty.
using Topology = std::vector<v1::MeshData>;

// Whether they are of the sheets that the header names.
bool is_sound(const v1::MeshData& mesh, const v1::SheetLayout& sheet);
bool is_sound(const Topology& topology, const v1::StreamHeader& header);

using Triangle = std::array<std::int32_t, 3>;

// Triangles cut out of one piece.
struct PanelRun {
  std::string name;
  std::size_t first = 0;  // triangle
  std::size_t count = 0;
  double grain_rad = 0;  // from v to the warp, anticlockwise
};

// A sheet and its triangles.
struct SheetMesh {
  v1::SheetLayout layout;
  std::vector<Triangle> triangles;         // particles, counted from the sheet's first
  std::vector<std::array<float, 2>> flat;  // corners of the flat shape, u (weft) and v (warp), m
  std::vector<Triangle> flat_triangles;    // corners of each triangle; as many as triangles
  std::vector<PanelRun> panels;            // together all triangles
};

// Of every sheet. A grid has its triangles, as they are streamed, and the flat shape where the
// topology has it. Precondition: the topology is sound.
std::vector<SheetMesh> meshes_of(const v1::StreamHeader& header, const Topology& topology);

// "3546 particles, 6890 triangles, 4 panels"
std::string shape_text(const SheetMesh& mesh);

}  // namespace weft::client

#pragma once

#include <optional>

#include "client/imports/imported_mesh.h"

namespace weft::client {

using FlatCorners = std::array<Vector2d, 3>;

FlatCorners flat_corners(const ImportedMesh& mesh, std::size_t triangle);
// Positive where corners run anticlockwise.
double signed_area(const FlatCorners& corners);
// The least height of a triangle, its area over half its longest edge.
double least_height(const FlatCorners& corners);
double least_height(const ImportedMesh& mesh, std::size_t triangle);  // of its flat shape

// Gives each particle one place for each (u, v) that its corners have, those within the tolerance
// being one, as files may repeat places, and share them between particles. Particles with one place
// come first, in their order.
void join_corners(ImportedMesh& mesh, double tolerance);

// What hangs together in the flat shape: the piece of each triangle; how many.
int find_islands(const ImportedMesh& mesh, std::vector<int>& island);

// Turns pieces over that lie with their back up, about the warp, so that it stays the warp; how
// many. The grain is the angle from the v axis to the warp, rad, anticlockwise.
int turn_mirrored_islands(ImportedMesh& mesh, double grain_rad);

// Takes the flat shape from a mesh that lies in a plane: u to the right of who looks at its front,
// v up (of one that lies level, away). False where it lies in none.
bool flatten(ImportedMesh& mesh);
// The same of each piece that hangs together, beside each other.
bool flatten_pieces(ImportedMesh& mesh);

// Lengths in space over those in the flat shape, of all edges.
struct ScaleFound {
  double median = 0;
  double low = 0, high = 0;             // 5 % of edges are below, and above
  std::vector<double> median_of_panel;  // or 0
};
ScaleFound find_scale(const ImportedMesh& mesh);

// Files in metres, decimetres, centimetres or millimetres, of cloth that is stretched a little:
// that unit within 1 %. Else the scale itself.
double rounded_scale(double found);

}  // namespace weft::client

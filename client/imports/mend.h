#pragma once

#include "client/imports/imported_mesh.h"

namespace weft::client {

// Makes particles that lie within the tolerance of one before them one with it; how many. 0: equal
// ones.
int join_points(ImportedMesh& mesh, double tolerance);

// Leaves out triangles that have a particle twice, or the same three as one before; how many.
int drop_repeated_triangles(ImportedMesh& mesh);
// Leaves out triangles without area in space or in the flat shape; how many.
int drop_empty_triangles(ImportedMesh& mesh);

// Turns triangles that face the other way than most of their piece; how many. A piece with one side
// alone, such as a Moebius strip, stays as it is.
int turn_triangles(ImportedMesh& mesh);

// Joins two particles of flat triangles lower than this part of the median height, so that what is
// left is higher, borders and seams stay where they are, and nothing turns over.
struct Collapse {
  int particles = 0;       // joined
  int left = 0;            // low triangles that could not be joined so
  double height = 0;       // below which a triangle is low, m
  double longest = 0;      // way of a particle in the flat shape, m
  double area_change = 0;  // of the flat shape, a fraction
};
inline constexpr double kSliver = 0.25;
Collapse collapse_slivers(ImportedMesh& mesh, double part = kSliver);

}  // namespace weft::client

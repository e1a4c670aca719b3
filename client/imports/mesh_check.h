#pragma once

#include "client/imports/imported_mesh.h"

namespace weft::client {

// What is wrong with how triangles hang together and lie in space: edges of three or more,
// neighbours that face opposite ways, equal and empty triangles, corners without a flat place.
// Pieces apart are allowed.
std::vector<Fault> find_faults(const ImportedMesh& mesh);

// What is wrong with the flat shape: empty triangles, ones turned over beside their neighbours,
// folds that overlap within what hangs together. Pieces may lie over each other.
std::vector<Fault> find_flat_faults(const ImportedMesh& mesh);

// Whether a triangle is a line or a point, up to rounding.
bool is_empty(const std::array<Vector3d, 3>& corners);

// Of each triangle, whether one before has the same particles.
std::vector<bool> find_repeated(const ImportedMesh& mesh);

// Pieces that hang together by edges.
int count_pieces(const ImportedMesh& mesh);

}  // namespace weft::client

#pragma once

#include "client/imports/imported_mesh.h"

namespace weft::client {

// Makes what the mesh's stitches join one particle, in the mean of their places. A point sewn to a
// line between two goes to the nearer one. Where the file has no flat shape, that is the pieces'
// own planes before.
void sew(ImportedMesh& mesh);

}  // namespace weft::client

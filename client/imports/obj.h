#pragma once

#include "client/imports/imported_mesh.h"

namespace weft::client {

// Reads the text of an OBJ file: v, vt, f, and for panels g where faces have two or more, else
// usemtl, else o; and C-IPC's stitch, points counted from 0. Curves, lines and points are passed
// over. What cannot be used is a Problem with lines.
ImportedMesh read_obj(const std::string& path, const std::string& text);

}  // namespace weft::client

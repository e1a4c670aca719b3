#pragma once

#include <string>

#include "client/figures/surface_nets.h"

namespace weft::client {

// The bytes of an OBJ file, or of a binary glTF file with one primitive.
std::string obj_of(const FigureMesh& mesh);
std::string glb_of(const FigureMesh& mesh);

}  // namespace weft::client

#pragma once

#include <string>
#include <vector>

#include "client/output/json.h"
#include "weft/v1/garment.pb.h"

namespace weft::client {

// A pattern from a file of another program, and what was done on the way, a sentence each.
struct ImportedPattern {
  v1::Pattern pattern;
  std::vector<std::string> notes;
};

// Whether JSON looks like GarmentCode's: "pattern" with "panels" by name.
bool is_garment_code(const Json& json);

// Reads GarmentCode's JSON, and that of its forerunner Garment-Pattern-Generator: edges are lines,
// curves of one or two control points in the edge's own coordinates, or arcs; stitches join whole
// edges. Panels keep their order and names, made plain. What cannot be understood is a Problem with
// panel and edge; whether panels can be cut is for the server to say.
ImportedPattern read_garment_code(const std::string& path, const Json& json);

}  // namespace weft::client

#pragma once

#include "core/triangles/rest_shape.h"

namespace weft {

// How close connections along edges come to a measured textile, in directions of the flat shape
// between warp and weft: least and largest ratio of what they store to what it would, where the
// sheet is bent a little to a cylinder, and where it is stretched a little.
struct ConnectionError {
  double least_bend = 0, most_bend = 0, least_stretch = 0, most_stretch = 0;
};

// The paper's model on triangles: a stretch connection along each edge (eq. 2), and across each
// inner one an interlaced connection between the corners opposite to it (eq. 3 to 5). Raw constants
// are those of all; measured ones are shared by area, so that on equilateral triangles an even
// textile stretches and bends as it should. Adds families to the mesh. Precondition: the sheet's
// bending law is ChoiKo.
ConnectionError add_connections(const SheetDefinition& sheet, const RestShape& shape, Mesh& mesh);

}  // namespace weft

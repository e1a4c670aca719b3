#pragma once

#include <vector>

#include "core/pattern/panel_mesher.h"
#include "core/pattern/pattern.h"

namespace weft {

bool starts_folded(const PatternPanel& panel);

// Whether a line leads on and on in the direction of the longest of its parts.
bool leads_on(const std::vector<Vector2d>& line);

// Where the points of a panel lie beside its plane, folded along its creases as it starts: right of
// u and above v, the outside of its cloth to +z, m. A crease that is not straight folds what is
// beside each of its points about the direction of the longest of its parts; beside the others
// cloth is sheared. The part with the point `fixed` stays in the plane. is_turned: the outside
// looks to -z.
// Precondition: creases that it starts folded along part it in two, and lead on.
std::vector<Vector3d> folded_points(const PatternPanel& panel,
                                    const std::vector<std::vector<int>>& creases,
                                    const PanelMesh& mesh, int fixed, bool is_turned);

}  // namespace weft

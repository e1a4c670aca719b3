#pragma once

#include "core/model/scene.h"

namespace weft {

// How far a sheet that hangs by an edge stretches under its own weight at that edge, rho g H / E,
// along warp and along weft; infinity where nothing resists.
struct SelfWeightStrain {
  double warp = 0, weft = 0;
};
SelfWeightStrain self_weight_strain(const SheetDefinition& sheet, const Environment& environment);

// Gives the sheet's textiles tensile stiffness no larger than this strain asks for. A clamp of
// bending that follows the stiffness follows it here too.
void cap_stretch(SheetDefinition& sheet, const Environment& environment, double strain);

}  // namespace weft

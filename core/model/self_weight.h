#pragma once

#include "core/model/scene.h"

namespace weft {

// How far a sheet that hangs by an edge stretches under its own weight at that edge, rho g H / E,
// along warp, along weft and, by shear, along the bias between them; infinity where nothing
// resists.
struct SelfWeightStrain {
  double warp = 0, weft = 0, bias = 0;
};
SelfWeightStrain self_weight_strain(const SheetDefinition& sheet, const Environment& environment);

// Makes the sheet's textiles no stiffer than this strain asks for, in tension and, lest it alone
// decides the step, in shear: no connection pulls by more than rho g H / strain. A clamp of bending
// that follows the stiffness follows it here too.
void cap_stretch(SheetDefinition& sheet, const Environment& environment, double strain);

// A sheet of the scene as it is simulated, but for its damping: capped where the scene asks for it.
SheetDefinition capped(const Scene& scene, std::size_t sheet);

}  // namespace weft

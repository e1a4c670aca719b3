#include "core/model/self_weight.h"

#include <algorithm>

namespace weft {
namespace {

// rho g H of a sheet that hangs along warp and along weft, N/m.
struct Load {
  double warp, weft;
};
Load load_of(const SheetDefinition& sheet, const Environment& environment) {
  const double given = environment.gravity.norm();
  const double gravity = given > 0 ? given : kStandardGravity;
  const double h = sheet.spacing();
  const auto* measured = std::get_if<MeasuredTextile>(&sheet.textile.model);
  const double areal_density =
      measured != nullptr ? measured->areal_density
                          : std::get<RawTextile>(sheet.textile.model).particle_mass / (h * h);
  const double weight = areal_density * gravity;
  const auto [warp, weft] = extent(sheet.shape);
  return {weight * warp * h, weight * weft * h};
}

}  // namespace

SelfWeightStrain self_weight_strain(const SheetDefinition& sheet, const Environment& environment) {
  const Load load = load_of(sheet, environment);
  const double most = std::max(load.warp, load.weft);
  if (const auto* measured = std::get_if<MeasuredTextile>(&sheet.textile.model))
    return {load.warp / measured->tensile_warp, load.weft / measured->tensile_weft,
            most / (2 * measured->shear)};
  const auto& raw = std::get<RawTextile>(sheet.textile.model);
  return {load.warp / raw.stretch, load.weft / raw.stretch, most / raw.shear};  // k = 2 G
}

void cap_stretch(SheetDefinition& sheet, const Environment& environment, double strain) {
  const Load load = load_of(sheet, environment);
  const double most = std::max(load.warp, load.weft) / strain;
  const auto cap = [&](Textile& textile) {
    if (auto* measured = std::get_if<MeasuredTextile>(&textile.model)) {
      measured->tensile_warp = std::min(measured->tensile_warp, load.warp / strain);
      measured->tensile_weft = std::min(measured->tensile_weft, load.weft / strain);
      measured->shear = std::min(measured->shear, most / 2);  // k = 2 G
    } else {
      auto& raw = std::get<RawTextile>(textile.model);
      raw.stretch = std::min(raw.stretch, most);
      raw.shear = std::min(raw.shear, most);
    }
  };
  cap(sheet.textile);
  for (PanelTextile& panel : sheet.panel_textiles) cap(panel.textile);
}

SheetDefinition capped(const Scene& scene, std::size_t sheet) {
  SheetDefinition definition = scene.sheets[sheet];
  if (const auto& strain = scene.solver.max_self_weight_strain)
    cap_stretch(definition, scene.environment, *strain);
  return definition;
}

}  // namespace weft

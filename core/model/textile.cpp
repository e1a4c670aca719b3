#include "core/model/textile.h"

#include <cmath>

namespace weft {
namespace {

MeasuredTextile mix(const MeasuredTextile& a, const MeasuredTextile& b, double share) {
  return {.areal_density = std::lerp(a.areal_density, b.areal_density, share),
          .tensile_warp = std::lerp(a.tensile_warp, b.tensile_warp, share),
          .tensile_weft = std::lerp(a.tensile_weft, b.tensile_weft, share),
          .shear = std::lerp(a.shear, b.shear, share),
          .bend_rigidity_warp = std::lerp(a.bend_rigidity_warp, b.bend_rigidity_warp, share),
          .bend_rigidity_weft = std::lerp(a.bend_rigidity_weft, b.bend_rigidity_weft, share),
          .air_drag = std::lerp(a.air_drag, b.air_drag, share)};
}

RawTextile mix(const RawTextile& a, const RawTextile& b, double share) {
  RawTextile mixed{.particle_mass = std::lerp(a.particle_mass, b.particle_mass, share),
                   .stretch = std::lerp(a.stretch, b.stretch, share),
                   .shear = std::lerp(a.shear, b.shear, share),
                   .bend = std::lerp(a.bend, b.bend, share),
                   .air_drag = std::lerp(a.air_drag, b.air_drag, share)};
  if (a.clamp || b.clamp)
    mixed.clamp = std::lerp(a.clamp.value_or(a.stretch), b.clamp.value_or(b.stretch), share);
  return mixed;
}

}  // namespace

Textile TextileRamp::at(std::int64_t frame) const {
  if (frame <= begin) return from;
  if (frame >= end) return to;
  const double share = static_cast<double>(frame - begin) / static_cast<double>(end - begin);
  const auto mix_given = [&](std::optional<double> a, std::optional<double> b) {
    return a && b ? std::lerp(*a, *b, share) : b;
  };
  Textile mixed{.model = {},
                .damping = mix_given(from.damping, to.damping),
                .friction = std::lerp(from.friction, to.friction, share),
                .damping_ratio = mix_given(from.damping_ratio, to.damping_ratio)};
  if (const auto* measured = std::get_if<MeasuredTextile>(&from.model))
    mixed.model = mix(*measured, std::get<MeasuredTextile>(to.model), share);
  else
    mixed.model = mix(std::get<RawTextile>(from.model), std::get<RawTextile>(to.model), share);
  return mixed;
}

}  // namespace weft

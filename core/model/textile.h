#pragma once

#include <cstdint>
#include <optional>
#include <variant>

namespace weft {

// A textile in measured units, independent of the mesh. Warp runs along a row, weft along a column.
struct MeasuredTextile {
  double areal_density = 0;       // kg/m^2
  double tensile_warp = 0;        // N/m
  double tensile_weft = 0;        // N/m
  double shear = 0;               // N/m per radian
  double bend_rigidity_warp = 0;  // N m
  double bend_rigidity_weft = 0;  // N m
  double air_drag = 0;            // kg/(m^2 s)

  bool operator==(const MeasuredTextile&) const = default;
};

// The paper's constants: one for every particle or connection of a mesh.
struct RawTextile {
  double particle_mass = 0;          // kg
  double stretch = 0;                // k_s, N/m
  double shear = 0;                  // k_s of the diagonals, N/m
  double bend = 0;                   // k_b, N m^2
  std::optional<double> clamp = {};  // c_b, N/m; absent: stretch
  double air_drag = 0;               // kg/s

  bool operator==(const RawTextile&) const = default;
};

// Of connections, kg/s: the paper's k_d.
inline constexpr double kDefaultDamping = 2e-4;
// Of a sheet's stiffest mode, 1 is critical: from here on connections that switch between taut and
// slack gain no energy, at any step within the linear bound.
inline constexpr double kSafeDampingRatio = 1e-3;

struct Textile {
  std::variant<MeasuredTextile, RawTextile> model;
  std::optional<double> damping = {};  // k_d, kg/s
  double friction = 0.3;               // Coulomb coefficient
  // Gives k_d by the damping ratio of the sheet's stiffest mode. Without either k_d is the default,
  // or what the safe ratio asks for where that is more.
  std::optional<double> damping_ratio = {};

  bool operator==(const Textile&) const = default;
};

// A textile that changes from frame to frame, linearly in every value: `from` up to frame `begin`,
// `to` from frame `end` on. Damping that is given otherwise in `from` is that of `to` all the
// while. Precondition: both are measured or both are raw; begin < end.
struct TextileRamp {
  Textile from, to;
  std::int64_t begin = 0, end = 0;

  Textile at(std::int64_t frame) const;
};

}  // namespace weft

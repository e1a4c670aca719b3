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

struct Textile {
  std::variant<MeasuredTextile, RawTextile> model;
  double damping = 2e-4;  // k_d, kg/s
  double friction = 0.3;  // Coulomb coefficient

  bool operator==(const Textile&) const = default;
};

// A textile that changes from frame to frame, linearly in every value: `from` up to frame `begin`,
// `to` from frame `end` on. Precondition: both are measured or both are raw; begin < end.
struct TextileRamp {
  Textile from, to;
  std::int64_t begin = 0, end = 0;

  Textile at(std::int64_t frame) const;
};

}  // namespace weft

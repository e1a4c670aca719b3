#pragma once

#include <array>
#include <vector>

#include "core/model/mesh.h"

namespace weft {

// Triangles that meet nothing: of each sheet, of each of its triangles; empty: none do.
using LeftOut = std::vector<std::vector<bool>>;

// All sheets of a scene as one surface. Particles are numbered through all sheets, in their order;
// triangles lie in blocks of neighbours, edges and particles with the first triangle that has them.
struct Cloth {
  explicit Cloth(const std::vector<SheetDefinition>& sheets, const LeftOut& left_out = {});

  int particles() const { return first_particle.back(); }
  int sheet_of(int particle) const { return sheet[static_cast<std::size_t>(particle)]; }
  // A particle as its sheet numbers it.
  int own_number(int particle) const {
    return particle - first_particle[static_cast<std::size_t>(sheet_of(particle))];
  }
  // Puts positions of all sheets together, (3 x particles) m: each(s) -> those of one.
  template <class Each>
  void join(const Each& each, Matrix3Xd& all) const {
    all.resize(3, particles());
    for (std::size_t s = 0; s + 1 < first_particle.size(); ++s) {
      const Matrix3Xd& x = each(s);
      all.middleCols(first_particle[s], x.cols()) = x;
    }
  }
  Matrix3Xd positions(const std::vector<Matrix3Xd>& x) const;

  std::vector<int> first_particle;  // of each sheet; then how many there are
  std::vector<int> sheet;           // of each particle
  std::vector<double> thickness;    // of the sheet around each particle, m
  double thickest = 0;              // of all, m
  std::vector<std::array<int, 3>> triangles;
  std::vector<std::array<Vector2d, 3>> flat;  // corners of each in the flat shape, m
  std::vector<std::array<int, 2>> edges;

  // Of each triangle, and one more: where its edges and its particles begin.
  std::vector<int> first_edge, first_corner;
  std::vector<int> corners;      // particles by triangle
  std::vector<int> first_block;  // triangle of each block; then how many there are
  std::vector<int> piece;        // that each block is cut from, through all sheets
};

// At which particles of a sheet keep others away, m: its thickness, but where triangles are so flat
// that the sheet would push itself apart.
std::vector<double> thickness_at_particles(const SheetDefinition& sheet);

}  // namespace weft

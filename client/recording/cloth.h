#pragma once

#include <array>
#include <string>
#include <vector>

#include "client/recording/points.h"
#include "client/recording/reader.h"
#include "client/sheet_layout.h"

namespace weft::client {

// Of a triangle from its first corner, where the sheet is flat: along warp and weft, m.
using FlatSides = std::array<std::array<double, 2>, 2>;

struct ClothPanel {
  std::string name;
  std::size_t first = 0, count = 0;  // triangles
  double grain_rad = 0;
  std::string preset{};  // its own textile, where its name is all that is known
  bool own_textile = false;
  v1::Textile textile{};  // the sheet's where it has no own
};

// A sheet of a recording as triangles, grids too, with the textiles it had at the start.
struct ClothMesh {
  std::vector<Triangle> triangles;  // particles, counted from the sheet's first
  std::vector<FlatSides> sides;     // of each
  std::vector<ClothPanel> panels;   // together all
  double spacing_m = 0;             // of a grid, else the median edge where it is flat
};
std::vector<ClothMesh> cloth_of(RecordingReader& recording);

// Of a panel where it is flat, m^2.
double area_of(const ClothMesh& mesh, const ClothPanel& panel);

// What strain is told of.
enum class Strain {
  kLargest,  // along warp or weft, the largest around a particle, 0 where nothing is stretched
  kWarp,     // the others as means around a particle, by area: l / L - 1
  kWeft,
  kShear,  // the sine of the angle
};

// Of each particle.
std::vector<double> strains_of(const ClothMesh& mesh, const Points& points, Strain strain);

// Of each particle, J/m^2: of the curvatures along warp and weft and of the twist, by the
// rigidities of the panels' textiles. Curvatures are how the normals turn over a triangle
// (Rusinkiewicz 2004); free borders have less than the cloth beside them.
std::vector<double> bending_of(const ClothMesh& mesh, const Points& points);

}  // namespace weft::client

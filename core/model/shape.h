#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace weft {

using Eigen::Vector2d;
using Eigen::Vector3d;

// rows x columns particles; particle (r, c) has index r * columns + c and lies at (c h, 0, r h).
struct Grid {
  int rows = 2;
  int columns = 2;
  double spacing = 0;  // h, m
  // Frames show a finer grid, of which each so many-th row and column is one of these; what lies
  // between follows from them (core/lattice/shown.h).
  int simulated_every = 1;
  double shown_spacing = 0;  // where that is more than 1, m
};

// Triangles cut out of one piece.
struct Panel {
  std::string name;
  int triangles = 0;  // how many
  double grain = 0;   // from the v axis of the flat shape to the warp, rad, anticlockwise
};

// A line along edges between two triangles that cloth is pressed along.
struct Fold {
  std::vector<int> particles;  // from one end to the other, or around to the first
  // By how much one side is turned out of the plane of the other, rad: 0 flat; positive where the
  // sides that normals point to come nearer.
  double angle = 0;
};

inline constexpr double kMostFold = 3.2;  // rad: beyond half a turn it is one to the other side

// Triangles of any outline, and the flat shape that they were cut in.
struct TriangleMesh {
  std::vector<Vector3d> start;                // of each particle, before the sheet is placed, m
  std::vector<std::array<int, 3>> triangles;  // particles, anticlockwise where normals point to
  std::vector<Vector2d> flat;                 // corners of the flat shape, u and v, m
  std::vector<std::array<int, 3>> flat_triangles;  // corners of each; empty: as `triangles`
  std::vector<Panel> panels;                       // runs of triangles, together all
  std::vector<Fold> folds;
  // These follow, see complete().
  double spacing = 0;                // median edge of the flat shape, m
  Vector2d size = Vector2d::Zero();  // of the largest panel along warp and weft, m
};

// Large, and never changed: shared.
using Triangles = std::shared_ptr<const TriangleMesh>;

// The mesh with what it lacks: a start from the flat shape, a flat shape from a start in the plane
// y = 0, one panel; and with what follows. Of a faulty mesh nothing follows.
Triangles complete(TriangleMesh mesh);

// Corner k of triangle t in the flat shape, u and v, m.
inline const Vector2d& flat_corner(const TriangleMesh& mesh, std::size_t t, std::size_t k) {
  const auto& corners = mesh.flat_triangles.empty() ? mesh.triangles : mesh.flat_triangles;
  return mesh.flat[static_cast<std::size_t>(corners[t][k])];
}

// What a sheet is cut as. Whoever needs to know more of it than the functions below tell belongs to
// the folder of its kind.
using SheetShape = std::variant<Grid, Triangles>;

int particle_count(const SheetShape& shape);

// Particles of each triangle, to draw, to push by wind, and to measure strain; anticlockwise where
// normals point to.
std::vector<std::array<int, 3>> triangles_of(const SheetShape& shape);
int triangle_count(const SheetShape& shape);

// Between neighbours: the length by which a sheet's own lengths are judged, m.
double spacing(const SheetShape& shape);
// Of its triangles, in the flat shape, m.
double shortest_edge(const SheetShape& shape);

// Along warp and weft, in spacings.
struct Extent {
  double warp = 0, weft = 0;
};
Extent extent(const SheetShape& shape);

// Whether frames show more particles of it than are simulated.
bool is_interpolated(const SheetShape& shape);
// As frames show it.
SheetShape shown(const SheetShape& shape);
// Index of a particle in what frames show, and of a shown one in what is simulated; none where it
// lies between these.
int shown_particle(const SheetShape& shape, int simulated);
std::optional<int> simulated_particle(const SheetShape& shape, int shown);

// Of a particle before the sheet is placed, m.
Vector3d local_position(const SheetShape& shape, int particle);

}  // namespace weft

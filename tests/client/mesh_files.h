#pragma once

#include <Eigen/Core>
#include <map>
#include <string>

namespace weft::testing {

// A square of 5 x 5 points, row by row from (0, 0, z) upwards, as an OBJ file; its UV are as its
// (x, y).
struct LatticeFile {
  double spacing = 1;
  double z = 0;
  bool uv = true;
  bool mirrored = false;                      // u is -x
  bool panels = false;                        // g left and right, of two columns of cells each
  int first = 0;                              // points of the file before these
  std::map<int, Eigen::Vector2d> moved{};     // points that lie elsewhere, in space and in UV
  std::map<int, Eigen::Vector2d> moved_uv{};  // in UV alone
};
std::string lattice_obj(const LatticeFile& file);

// A tube of 12 points around and 3 along y from 0 to 1, cut open in its UV.
std::string tube_obj();

// A .glb file: a square of 2 x 1 m in two primitives, of materials "body" and "belt", 4 points each
// with UV at 1 m for a unit, under a node that moves it by (0, 1, 0).
std::string square_glb();

}  // namespace weft::testing

#pragma once

#include <array>
#include <vector>

#include "core/cloth_contact/cloth.h"
#include "core/contact/contact.h"
#include "core/moving_sheet.h"

namespace weft {

// Keeps what lies between the particles of a sheet out of boxes. Contact with colliders pushes
// particles alone; between these an edge of a box would cut a cell, and a corner a triangle. So
// edges of cloth are kept at the skin from edges of boxes, and triangles from corners.
//
// What it does follows from where particles are: how far parts of the sheet were from edges when
// last looked at only tells which to look at.
class BoxEdges {
 public:
  explicit BoxEdges(const SheetDefinition& sheet);

  // The sheet may be anywhere now.
  void forget();
  // After a step of dt (s) in which particles were pressed so far without speed, m. Inelastic, with
  // friction, as contact of particles; what reaches deeper than it can have come in the step leaves
  // at Contacts::kOutward. How far that moved a particle at most, m.
  double keep_out(const Contacts& contacts, double dt, double pressed, MovingSheet& sheet);

 private:
  // Corners of triangles, or both ends of an edge: columns of x_, the last one twice.
  using Corners = std::array<int, 3>;
  struct Part {
    int number;  // of an edge or a triangle
    Corners corners;
    double gap;  // to what it may touch, at least, m
  };
  // A point of a part that is nearer to a box than the skin.
  struct Touch {
    Corners corners;
    std::array<double, 3> weight, share;  // of corners in its motion, and of its motion in theirs
    Vector3d normal, carried;             // out of the box; displacement of that in the step, m
    double depth;                         // m
    double friction;
    double pushed = 0, stopped = 0;  // so far, in place and in the step, m
  };

  void find_due();
  int column(int particle);
  void meet(const Contacts::Placed& placed, double skin);
  void meet_edge(const Contacts::Placed& placed, const Vector3d& half, double skin, Part& edge);
  void meet_corner(const Contacts::Placed& placed, const Vector3d& half, double skin,
                   Part& triangle);
  void add(const Contacts::Placed& placed, const Part& part, const std::array<double, 3>& weight,
           const Vector3d& normal, double depth);
  void keep_due();
  void separate(double creep);

  Cloth cloth_;  // the sheet alone
  // Of blocks, edges and triangles: how far everything has to come until they may touch, since
  // forget(), m; and how far it has come.
  std::vector<double> block_due_, edge_due_, triangle_due_;
  double due_ = 0, come_ = 0;

  // those that are looked at, and their particles
  std::vector<int> blocks_, particles_, column_, moved_;
  std::vector<Part> edges_, triangles_;
  Matrix3Xd x_, d_, local_, by_, in_step_;  // m
  std::vector<double> inverse_mass_;        // 1/kg
  std::vector<Touch> touches_;
};

}  // namespace weft

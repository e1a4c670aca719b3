#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/contact/contact.h"
#include "core/moving_sheet.h"

namespace weft {

// Colliders push particles, and an edge of a box would cut the cells between them. So edges of
// cloth are kept as far from edges and corners of boxes as the skin is thick, and triangles from
// corners. What comes near is listed anew in each frame, and where cloth has come far.
class BoxEdges {
 public:
  explicit BoxEdges(const SheetDefinition& sheet);

  // A frame begins.
  void forget() { lasts_ = -1; }
  // After a step of dt, s.
  void keep_off(const Contacts& contacts, double dt, MovingSheet& sheet);

 private:
  struct Triangle {
    std::array<int, 3> particles;
    std::array<bool, 3> edges;  // from each to the next: whether it is listed with this triangle
  };
  // A triangle, or its edge from one corner to the next, near a corner or an edge of a box. It is
  // not looked at until cloth has come so far, m.
  struct Near {
    std::size_t collider;
    int place;                     // of the box
    std::array<int, 3> particles;  // the last of an edge is -1
    double clear = 0;

    int count() const { return particles[2] < 0 ? 2 : 3; }
  };
  // A particle that is pushed, m.
  struct Mover {
    int particle;
    Vector3d d;                                                  // in the step, before
    Vector3d by = Vector3d::Zero(), in_step = Vector3d::Zero();  // what is added
    Vector3d more_by = by, more_in_step = in_step;               // in a round
    int touching = 0;                                            // so many
  };
  // What is within the skin at a place, which lies between particles.
  struct Touching {
    std::array<int, 3> movers{-1, -1, -1};
    Vector3d weights, share = Vector3d::Zero();  // of the place; in what it moves by
    Vector3d out, carried;
    double friction;
    double part = 1;                 // of what it needs, that it gets in a round
    double depth = 0;                // that it is pushed out by, m
    double stopped = 0, rubbed = 0;  // in all rounds, m
  };

  void look(const Contacts& contacts, const MovingSheet& sheet);
  void find_touching(const Contacts& contacts, double dt, const MovingSheet& sheet);
  void part();
  Mover& mover(int particle, const Vector3d& d);

  std::vector<Triangle> triangles_;
  double margin_;  // of what is listed, m
  std::vector<Near> edges_, corners_;
  double come_ = 0, lasts_ = -1;  // since these were listed, and until they are anew, m

  std::vector<Near*> due_;
  std::vector<int> particles_;  // of what is due
  Matrix3Xd x_, d_;             // of these, m
  std::vector<Touching> touching_;
  std::vector<Mover> movers_;
  std::vector<int> number_;  // of each particle among them, or -1
};

}  // namespace weft

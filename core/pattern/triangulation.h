#pragma once

#include <algorithm>
#include <array>
#include <set>
#include <utility>
#include <vector>

#include "core/model/shape.h"
#include "core/pattern/sets.h"

namespace weft {

// 1 where three points run anticlockwise, -1 clockwise, 0 on a line. Exact.
int orientation(const Vector2d& a, const Vector2d& b, const Vector2d& c);

// Triangles that fill a polygon, by Delaunay's rule as far as the polygon lets them. That is held
// to up to rounding; that triangles run anticlockwise and do not overlap is exact.
class Triangulation {
 public:
  // The polygon does not touch itself, and runs anticlockwise.
  explicit Triangulation(std::vector<Vector2d> polygon);

  // Adds a point; not where one is, on the polygon or outside of it. Whether it did.
  bool insert(const Vector2d& point);
  // Makes sides of the lines from point to point, for good.
  // Precondition: they pass no other point, and cross none that is kept.
  void keep(const std::vector<int>& line);
  // Moves points that are not the polygon's, as far as triangles stay anticlockwise, and puts
  // Delaunay's rule in order.
  void move(const std::vector<Vector2d>& points);
  // Where a quad is one of either diagonal, takes that whose upper end is nearer to the line
  // x = `axis`, m, as points lie with the grain upwards: mirrored ones have mirrored triangles.
  void settle_ties(double grain, double axis);

  const std::vector<Vector2d>& points() const { return points_; }  // the polygon's first
  std::vector<std::array<int, 3>> triangles() const;

 private:
  struct Triangle {
    std::array<int, 3> corner;
    std::array<int, 3> beside;  // across the side from corner k to the next; -1: none
  };
  struct Side {
    int triangle, k;
  };
  // Two triangles: the diagonal from a to b, c to its left, d to its right.
  struct Quad {
    int a, b, c, d;
    int other, back;  // the triangle with d, and the diagonal's number there
  };

  const Vector2d& at(int point) const { return points_[as_index(point)]; }
  Triangle& triangle(int t) { return triangles_[as_index(t)]; }
  const Triangle& triangle(int t) const { return triangles_[as_index(t)]; }

  void clip_ears();
  void link();
  int find(const Vector2d& point) const;
  std::vector<int> triangles_at(int point) const;
  std::size_t corner_of(int t, int point) const;
  std::vector<std::pair<int, int>> sides_across(int a, int b) const;
  void keep(int a, int b);
  bool is_kept(int a, int b) const { return !kept_.empty() && kept_.contains(std::minmax(a, b)); }
  void replace_neighbour(int t, int old, int now);
  Quad across(const Side& side) const;
  // How much it wants the other diagonal: above 0 it does.
  double excess(const Quad& quad) const;
  bool is_convex(const Quad& quad) const;
  void flip(const Side& side, const Quad& quad);
  void restore(std::vector<Side> sides);
  void restore_all();

  std::vector<Vector2d> points_;
  std::size_t polygon_ = 0;
  std::vector<Triangle> triangles_;
  std::set<std::pair<int, int>> kept_;
  mutable int last_ = 0;  // found
};

}  // namespace weft

#pragma once

#include <Eigen/Geometry>
#include <limits>
#include <vector>

#include "core/model/body.h"

namespace weft {

// Triangles in boxes that lie in boxes: what is near to a point, or in the way of a ray.
class TriangleTree {
 public:
  // Keeps hold of the mesh. Precondition: it has triangles.
  explicit TriangleTree(const BodyMesh& mesh);

  struct Nearest {
    double squared = std::numeric_limits<double>::infinity();  // of the distance, m^2
    int triangle = -1;
  };
  // The nearest triangle. A guess, any triangle's number, makes it quick where it is near.
  Nearest nearest(const Vector3d& point, int guess) const;

  // Quicker for many points that are close together.
  class Around;

  // Where a ray from within triangle `from` first meets another one, m along `direction`, of length
  // 1; infinity where it does not.
  double first_hit(int from, const Vector3d& start, const Vector3d& direction) const;

 private:
  // Around a triangle, in its plane.
  struct Disc {
    Vector3d middle, normal;  // m; of length 1
    double radius;            // m
  };
  struct Node {
    Eigen::AlignedBox3d box;
    int first = 0;  // of its triangles in order_; of an inner node, its second child
    int count = 0;  // of triangles; 0: an inner node, whose first child comes next
  };
  Disc disc_of(int triangle, const Vector3d& middle) const;
  void build(int first, int last, const std::vector<Vector3d>& middles);
  const Vector3d& corner(int triangle, std::size_t k) const {
    const int vertex = mesh_.triangles[static_cast<std::size_t>(triangle)][k];
    return mesh_.vertices[static_cast<std::size_t>(vertex)];
  }
  static double least_squared(const Disc& disc, const Vector3d& point);
  double squared_distance(int triangle, const Vector3d& point) const;

  const BodyMesh& mesh_;
  std::vector<int> order_;
  std::vector<Disc> discs_;  // in that order
  std::vector<Node> nodes_;
};

// All triangles that may be the nearest to points in a ball, side by side.
class TriangleTree::Around {
 public:
  // Keeps hold of the tree.
  explicit Around(const TriangleTree& tree) : tree_(tree) {}

  // From now on points are no farther than `radius` from `middle`, m, whose nearest triangle is
  // so far, m.
  void set(const Vector3d& middle, double radius, double distance);
  // As that of the tree.
  Nearest nearest(const Vector3d& point, int guess);

 private:
  const TriangleTree& tree_;
  Vector3d middle_ = Vector3d::Zero();
  std::vector<int> triangles_;
  Eigen::Matrix<float, Eigen::Dynamic, 7> discs_;  // from middle_: middles; normals; radii
  Eigen::ArrayXf above_, squared_, least_;         // of each, m^2
};

}  // namespace weft

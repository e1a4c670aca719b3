#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/model/mesh.h"

namespace weft {

// The flat shape of a sheet of triangles as its textile sees it: u along the warp, v along the
// weft. Corners of one particle may differ, where a seam is closed. Triangles run anticlockwise.
struct RestShape {
  int particles = 0;
  std::vector<std::array<int, 3>> triangles;     // particles of each
  std::vector<std::array<Vector2d, 3>> corners;  // (u, v) of each, m
  std::vector<int> panel{};                      // of each triangle; empty: 0
};
RestShape rest_shape(const TriangleMesh& mesh);

inline int panel_of(const RestShape& shape, std::size_t triangle) {
  return shape.panel.empty() ? 0 : shape.panel[triangle];
}

// Rest area of a triangle, m^2.
double area(const std::array<Vector2d, 3>& corners);

// Rest area that belongs to each particle, a third of every triangle around it, m^2.
VectorXd areas(const RestShape& shape);

// Each once, the smaller index first, in ascending order.
std::vector<Connection> edges(const RestShape& shape);

// Of each particle, whether it lies on an edge of one triangle alone.
std::vector<bool> border(const RestShape& shape);

// Which triangles each particle is a corner of.
class Corners {
 public:
  struct At {
    int triangle, corner;
  };
  explicit Corners(const RestShape& shape);
  // Of particle i, in order of triangles.
  const At* begin(int i) const { return all_.data() + first_[static_cast<std::size_t>(i)]; }
  const At* end(int i) const { return all_.data() + first_[static_cast<std::size_t>(i) + 1]; }

 private:
  std::vector<std::size_t> first_;
  std::vector<At> all_;
};

std::vector<MembraneElement> make_membrane(const RestShape& shape);

}  // namespace weft

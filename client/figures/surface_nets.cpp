#include "client/figures/surface_nets.h"

#include <algorithm>
#include <cmath>

#include "client/processors.h"

namespace weft::client {
namespace {

using NetCorner = std::array<int, 3>;

class NetLattice {
 public:
  NetLattice(const std::function<double(const Vector3d&)>& function, const Vector3d& low,
             const Vector3d& high, double cell)
      : low_(low), cell_(cell) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<Eigen::Index>(axis);
      size_[axis] = static_cast<int>(std::ceil((high[k] - low[k]) / cell)) + 1;
    }
    values_.resize(static_cast<std::size_t>(size_[0] * size_[1] * size_[2]));
    on_all_processors(1 + (size_[2] - 1) / kBlock, [&](int layer) {
      for (int y = 0; y < size_[1]; y += kBlock)
        for (int x = 0; x < size_[0]; x += kBlock) set_block(function, {x, y, layer * kBlock});
    });
    while (fill_gaps()) {
    }
  }

  FigureMesh surface() {
    vertex_.assign(values_.size(), -1);
    for_each_cell([&](const NetCorner& at) { add_vertex(at); });
    for_each_cell([&](const NetCorner& at) {
      for (std::size_t axis = 0; axis < 3; ++axis) add_quad(at, axis);
    });
    return std::move(mesh_);
  }

 private:
  std::size_t index(const NetCorner& at) const {
    return static_cast<std::size_t>((at[2] * size_[1] + at[1]) * size_[0] + at[0]);
  }
  double value(const NetCorner& at) const { return values_[index(at)]; }
  bool inside(const NetCorner& at) const { return value(at) < 0; }
  Vector3d place(const Vector3d& at) const { return low_ + cell_ * at; }
  static NetCorner moved(NetCorner at, std::size_t axis, int by = 1) {
    at[axis] += by;
    return at;
  }

  // Corners that are all far from the surface have one value.
  void set_block(const std::function<double(const Vector3d&)>& function, const NetCorner& first) {
    constexpr double kHalf = (kBlock - 1) / 2.0;
    const double least = 2 * (std::sqrt(3.0) * kHalf + 1) * cell_;
    const double middle =
        function(place(Vector3d(first[0], first[1], first[2]) + Vector3d::Constant(kHalf)));
    const bool far = std::abs(middle) > least;
    for (int z = first[2]; z < std::min(first[2] + kBlock, size_[2]); ++z)
      for (int y = first[1]; y < std::min(first[1] + kBlock, size_[1]); ++y)
        for (int x = first[0]; x < std::min(first[0] + kBlock, size_[0]); ++x)
          values_[index({x, y, z})] = far ? middle : function(place(Vector3d(x, y, z)));
  }

  // Those that the surface crosses.
  template <class F>
  void for_each_cell(const F& visit) {
    for (int z = 0; z + 1 < size_[2]; ++z)
      for (int y = 0; y + 1 < size_[1]; ++y) {
        const double* const values = &values_[index({0, y, z})];
        const int row = size_[0], layer = size_[0] * size_[1];
        const auto inside_at = [&](int x) {  // of the four corners there
          return (values[x] < 0 ? 1 : 0) + (values[x + row] < 0 ? 1 : 0) +
                 (values[x + layer] < 0 ? 1 : 0) + (values[x + layer + row] < 0 ? 1 : 0);
        };
        for (int x = 0, before = inside_at(0); x + 1 < row; ++x) {
          int after = inside_at(x + 1);
          if (before + after > 0 && before + after < 8) {
            visit(NetCorner{x, y, z});
            after = inside_at(x + 1);  // it may fill gaps
          }
          before = after;
        }
      }
  }

  // Two sheets that meet in a face of a cell, inside at two corners opposite one another, would
  // share an edge. Whether there were any.
  bool fill_gaps() {
    bool found = false;
    for_each_cell([&](const NetCorner& at) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
        const NetCorner one = moved(at, u), other = moved(at, v), across = moved(one, v);
        const bool first = inside(at);
        if (first != inside(across) || first == inside(one) || inside(one) != inside(other))
          continue;
        const NetCorner& outside = first ? one : at;
        values_[index(outside)] = -0.01 * cell_;
        found = true;
      }
    });
    return found;
  }

  // The mean of where the surface crosses the cell's edges.
  void add_vertex(const NetCorner& cell) {
    Vector3d sum = Vector3d::Zero();
    int crossings = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (int k = 0; k < 4; ++k) {
        const NetCorner from = moved(moved(cell, (axis + 1) % 3, k & 1), (axis + 2) % 3, k >> 1);
        const double a = value(from), b = value(moved(from, axis));
        if ((a < 0) == (b < 0)) continue;
        Vector3d at(from[0], from[1], from[2]);
        at[static_cast<Eigen::Index>(axis)] += a / (a - b);
        sum += at;
        ++crossings;
      }
    if (crossings == 0) return;
    vertex_[index(cell)] = static_cast<int>(mesh_.vertices.size());
    mesh_.vertices.push_back(place(sum / crossings));
  }

  // Around an edge that the surface crosses.
  void add_quad(const NetCorner& from, std::size_t axis) {
    const bool leaves = inside(from);
    if (leaves == inside(moved(from, axis))) return;
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    const int a = vertex_[index(moved(moved(from, u, -1), v, -1))],
              b = vertex_[index(moved(from, v, -1))];
    const int c = vertex_[index(from)], d = vertex_[index(moved(from, u, -1))];
    if (leaves) {
      mesh_.triangles.push_back({a, b, c});
      mesh_.triangles.push_back({a, c, d});
    } else {
      mesh_.triangles.push_back({a, c, b});
      mesh_.triangles.push_back({a, d, c});
    }
  }

  static constexpr int kBlock = 4;  // corners along an edge

  Vector3d low_;
  double cell_;
  std::array<int, 3> size_{};
  std::vector<double> values_;
  std::vector<int> vertex_;  // of each cell, by its first corner
  FigureMesh mesh_;
};

}  // namespace

FigureMesh surface_of(const std::function<double(const Vector3d&)>& function, const Vector3d& low,
                      const Vector3d& high, double cell) {
  return NetLattice(function, low, high, cell).surface();
}

void smooth(FigureMesh& mesh, int rounds) {
  constexpr double kShrink = 0.5, kGrow = -0.53;
  std::vector<Vector3d> sums(mesh.vertices.size());
  std::vector<int> counts(mesh.vertices.size());
  for (int round = 0; round < 2 * rounds; ++round) {
    std::fill(sums.begin(), sums.end(), Vector3d::Zero());
    std::fill(counts.begin(), counts.end(), 0);
    for (const auto& triangle : mesh.triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t i = as_index(triangle[k]);
        sums[i] += mesh.vertices[as_index(triangle[(k + 1) % 3])];
        ++counts[i];
      }
    const double share = round % 2 == 0 ? kShrink : kGrow;
    for (std::size_t i = 0; i < sums.size(); ++i)
      mesh.vertices[i] += share * (sums[i] / counts[i] - mesh.vertices[i]);
  }
}

}  // namespace weft::client

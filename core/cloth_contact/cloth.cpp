#include "core/cloth_contact/cloth.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace weft {
namespace {

constexpr std::size_t kBlockTriangles = 36;  // about as many in each

// Divides triangles across the longer side, again and again, into blocks of nearly as many.
void divide(std::span<int> triangles, std::size_t blocks, const std::vector<Vector3d>& centers,
            std::vector<std::size_t>& sizes) {
  if (blocks <= 1) {
    sizes.push_back(triangles.size());
    return;
  }
  Eigen::AlignedBox3d box;
  const auto center = [&](int t) -> const Vector3d& {
    return centers[static_cast<std::size_t>(t)];
  };
  for (const int t : triangles) box.extend(center(t));
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  const std::size_t few = blocks / 2, half = triangles.size() * few / blocks;
  std::nth_element(triangles.begin(), triangles.begin() + static_cast<std::ptrdiff_t>(half),
                   triangles.end(), [&](int s, int t) {
                     const double a = center(s)[axis], b = center(t)[axis];
                     return a < b || (a == b && s < t);
                   });
  divide(triangles.first(half), few, centers, sizes);
  divide(triangles.subspan(half), blocks - few, centers, sizes);
}

// How many triangles each piece has.
std::vector<std::size_t> pieces_of(const SheetShape& shape) {
  const auto* mesh = std::get_if<Triangles>(&shape);
  if (mesh == nullptr) return {static_cast<std::size_t>(triangle_count(shape))};
  std::vector<std::size_t> pieces;
  for (const Panel& panel : (*mesh)->panels)
    if (panel.triangles > 0) pieces.push_back(static_cast<std::size_t>(panel.triangles));
  return pieces;
}

std::array<Vector2d, 3> flat_corners(const SheetShape& shape, int triangle,
                                     const std::array<int, 3>& particles) {
  std::array<Vector2d, 3> corners;
  const auto* mesh = std::get_if<Triangles>(&shape);
  for (std::size_t k = 0; k < 3; ++k) {
    if (mesh != nullptr) {
      corners[k] = flat_corner(**mesh, static_cast<std::size_t>(triangle), k);
    } else {
      const Vector3d at = local_position(shape, particles[k]);
      corners[k] = {at.z(), at.x()};
    }
  }
  return corners;
}

}  // namespace

std::vector<double> thickness_at_particles(const SheetDefinition& sheet) {
  std::vector<double> thickness(static_cast<std::size_t>(sheet.particle_count()),
                                sheet.thickness_or_default());
  const auto* mesh = std::get_if<Triangles>(&sheet.shape);
  if (mesh == nullptr) return thickness;
  const TriangleMesh& shape = **mesh;
  for (std::size_t t = 0; t < shape.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector2d a = flat_corner(shape, t, k), side = flat_corner(shape, t, (k + 1) % 3) - a,
                     base = flat_corner(shape, t, (k + 2) % 3) - flat_corner(shape, t, (k + 1) % 3);
      const double height = std::abs(side.x() * base.y() - side.y() * base.x()) / base.norm();
      double& at = thickness[static_cast<std::size_t>(shape.triangles[t][k])];
      at = std::min(at, height / 2);
    }
  }
  return thickness;
}

Cloth::Cloth(const std::vector<SheetDefinition>& sheets, const LeftOut& left_out) {
  first_particle.push_back(0);
  first_block.push_back(0);
  int pieces = 0;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const SheetDefinition& definition = sheets[s];
    const int first = first_particle.back();
    first_particle.push_back(first + definition.particle_count());
    sheet.resize(static_cast<std::size_t>(first_particle.back()), static_cast<int>(s));
    const std::vector<double> own = thickness_at_particles(definition);
    thickness.insert(thickness.end(), own.begin(), own.end());

    const std::vector<std::array<int, 3>> given = triangles_of(definition.shape);
    std::vector<Vector3d> centers;
    centers.reserve(given.size());
    for (const auto& [a, b, c] : given)
      centers.emplace_back(local_position(definition.shape, a) +
                           local_position(definition.shape, b) +
                           local_position(definition.shape, c));
    const bool all = left_out.empty() || left_out[s].empty();
    std::vector<int> order;
    std::vector<std::size_t> sizes;
    for (int t = 0; const std::size_t count : pieces_of(definition.shape)) {
      const std::size_t begin = order.size();
      for (const int end = t + static_cast<int>(count); t < end; ++t)
        if (all || !left_out[s][static_cast<std::size_t>(t)]) order.push_back(t);
      const std::size_t in_piece = order.size() - begin;
      if (in_piece > 0)
        divide(std::span(order).subspan(begin), (in_piece + kBlockTriangles / 2) / kBlockTriangles,
               centers, sizes);
      for (const std::size_t size : sizes)
        first_block.push_back(first_block.back() + static_cast<int>(size));
      piece.resize(first_block.size() - 1, pieces++);
      sizes.clear();
    }
    for (const int t : order) {
      const auto& [a, b, c] = given[static_cast<std::size_t>(t)];
      triangles.push_back({first + a, first + b, first + c});
      flat.push_back(flat_corners(definition.shape, t, {a, b, c}));
    }
  }

  thickest = *std::max_element(thickness.begin(), thickness.end());

  std::vector<bool> placed(static_cast<std::size_t>(particles()));
  std::vector<std::vector<int>> joined(placed.size());  // ends of edges, from their lower one
  for (const auto& triangle : triangles) {
    first_edge.push_back(static_cast<int>(edges.size()));
    first_corner.push_back(static_cast<int>(corners.size()));
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangle[k], triangle[(k + 1) % 3]);
      auto& ends = joined[static_cast<std::size_t>(low)];
      if (std::find(ends.begin(), ends.end(), high) == ends.end()) {
        ends.push_back(high);
        edges.push_back({low, high});
      }
      const auto particle = static_cast<std::size_t>(triangle[k]);
      if (placed[particle]) continue;
      placed[particle] = true;
      corners.push_back(triangle[k]);
    }
  }
  first_edge.push_back(static_cast<int>(edges.size()));
  first_corner.push_back(static_cast<int>(corners.size()));
}

Matrix3Xd Cloth::positions(const std::vector<Matrix3Xd>& x) const {
  Matrix3Xd all;
  join([&](std::size_t s) -> const Matrix3Xd& { return x[s]; }, all);
  return all;
}

}  // namespace weft

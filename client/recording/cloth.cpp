#include "client/recording/cloth.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "client/exports/normals.h"

namespace weft::client {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Slopes = Eigen::Matrix<double, 3, 2>;  // of a place along warp and weft

Matrix2d matrix_of(const FlatSides& sides) {
  Matrix2d columns;
  columns << sides[0][0], sides[1][0], sides[0][1], sides[1][1];
  return columns;
}

double flat_area(const FlatSides& sides) { return std::abs(matrix_of(sides).determinant()) / 2; }

// `place`: of corner k of triangle t, where the sheet is flat, along warp and weft.
template <class Place>
void lay_flat(ClothMesh& mesh, std::size_t first, std::size_t count, const Place& place) {
  for (std::size_t t = first; t < first + count; ++t) {
    FlatSides& sides = mesh.sides.emplace_back();
    for (std::size_t k = 0; k < 2; ++k) {
      const Vector2d side = place(t, k + 1) - place(t, 0);
      sides[k] = {side.x(), side.y()};
    }
  }
}

double median_edge(const ClothMesh& mesh) {
  std::vector<double> lengths;
  for (const FlatSides& sides : mesh.sides) {
    const Matrix2d columns = matrix_of(sides);
    lengths.insert(lengths.end(), {columns.col(0).norm(), columns.col(1).norm(),
                                   (columns.col(1) - columns.col(0)).norm()});
  }
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

// Of the panels that have their own, as the asset of the mesh says.
void take_textiles(ClothMesh& mesh, const std::string& asset) {
  v1::MeshData data;
  if (!data.ParseFromString(asset)) return;
  for (int p = 0; p < data.panels_size() && p < static_cast<int>(mesh.panels.size()); ++p) {
    const v1::Textile& textile = data.panels(p).textile();
    ClothPanel& panel = mesh.panels[static_cast<std::size_t>(p)];
    panel.preset = textile.preset();
    panel.own_textile = textile.has_measured();
    if (panel.own_textile) panel.textile = textile;
  }
}

Vector3d corner(const Points& points, const Triangle& triangle, std::size_t k) {
  const auto i = static_cast<std::size_t>(triangle[k]);
  return {points.x[i], points.y[i], points.z[i]};
}

// How something changes over triangle t, 1/m.
template <class Value>
Slopes slopes_of(const ClothMesh& mesh, std::size_t t, const Value& value) {
  Slopes sides;
  for (std::size_t k = 0; k < 2; ++k)
    sides.col(static_cast<Eigen::Index>(k)) = value(k + 1) - value(0);
  return sides * matrix_of(mesh.sides[t]).inverse();
}

Slopes threads_of(const ClothMesh& mesh, std::size_t t, const Points& points) {
  return slopes_of(mesh, t, [&](std::size_t k) { return corner(points, mesh.triangles[t], k); });
}

double strain_of(const Slopes& threads, Strain strain) {
  const double warp = threads.col(0).norm(), weft = threads.col(1).norm();
  switch (strain) {
    case Strain::kLargest:
      return std::max(warp, weft) - 1;
    case Strain::kWarp:
      return warp - 1;
    case Strain::kWeft:
      return weft - 1;
    case Strain::kShear:
      break;
  }
  return warp * weft > 0 ? threads.col(0).dot(threads.col(1)) / (warp * weft) : 0;
}

// Of each particle the mean of the triangles around it, by area.
std::vector<double> means_of(const ClothMesh& mesh, const std::vector<double>& values,
                             std::size_t particles) {
  std::vector<double> means(particles), areas(particles);
  for (std::size_t t = 0; t < values.size(); ++t) {
    const double area = flat_area(mesh.sides[t]);
    for (const int i : mesh.triangles[t]) {
      means[static_cast<std::size_t>(i)] += area * values[t];
      areas[static_cast<std::size_t>(i)] += area;
    }
  }
  for (std::size_t i = 0; i < particles; ++i)
    if (areas[i] > 0) means[i] /= areas[i];
  return means;
}

double energy_of(const Slopes& threads, const Slopes& turns, const v1::MeasuredTextile& textile) {
  const double warp = textile.bend_rigidity_warp_n_m(), weft = textile.bend_rigidity_weft_n_m();
  const Matrix2d curvature = threads.transpose() * turns;
  const double twist = (curvature(0, 1) + curvature(1, 0)) / 2;
  return (warp * std::pow(curvature(0, 0), 2) + weft * std::pow(curvature(1, 1), 2) +
          (warp + weft) * std::pow(twist, 2)) /
         2;
}

}  // namespace

std::vector<ClothMesh> cloth_of(RecordingReader& recording) {
  std::vector<ClothMesh> cloth;
  const auto meshes = meshes_of(recording.header(), recording.topology());
  const Assets assets = recording.assets();
  for (std::size_t s = 0; s < meshes.size(); ++s) {
    const SheetMesh& from = meshes[s];
    const v1::Sheet& sheet = recording.scene().sheets(static_cast<int>(s));
    ClothMesh& mesh = cloth.emplace_back();
    mesh.triangles = from.triangles;
    for (const PanelRun& run : from.panels)
      mesh.panels.push_back(
          {run.name, run.first, run.count, run.grain_rad, {}, false, sheet.textile()});
    if (is_grid(from.layout)) {
      mesh.spacing_m = sheet.grid().spacing_m();
      lay_flat(mesh, 0, mesh.triangles.size(), [&](std::size_t t, std::size_t k) -> Vector2d {
        const auto [row, column] = place_in(from.layout, from.triangles[t][k]);
        return {mesh.spacing_m * column, mesh.spacing_m * row};
      });
      continue;
    }
    for (const ClothPanel& panel : mesh.panels) {
      const double sine = std::sin(panel.grain_rad), cosine = std::cos(panel.grain_rad);
      lay_flat(mesh, panel.first, panel.count, [&](std::size_t t, std::size_t k) -> Vector2d {
        const auto [u, v] = from.flat[static_cast<std::size_t>(from.flat_triangles[t][k])];
        return {cosine * v - sine * u, -cosine * u - sine * v};
      });
    }
    mesh.spacing_m = median_edge(mesh);
    if (const auto asset = assets.find(sheet.triangles().asset()); asset != assets.end())
      take_textiles(mesh, asset->second);
  }
  return cloth;
}

double area_of(const ClothMesh& mesh, const ClothPanel& panel) {
  double area = 0;
  for (std::size_t t = panel.first; t < panel.first + panel.count; ++t)
    area += flat_area(mesh.sides[t]);
  return area;
}

std::vector<double> strains_of(const ClothMesh& mesh, const Points& points, Strain strain) {
  std::vector<double> values;
  values.reserve(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    values.push_back(strain_of(threads_of(mesh, t, points), strain));
  if (strain != Strain::kLargest) return means_of(mesh, values, points.x.size());
  std::vector<double> largest(points.x.size());
  for (std::size_t t = 0; t < values.size(); ++t) {
    for (const int i : mesh.triangles[t]) {
      double& there = largest[static_cast<std::size_t>(i)];
      there = std::max(there, values[t]);
    }
  }
  return largest;
}

std::vector<double> bending_of(const ClothMesh& mesh, const Points& points) {
  std::vector<std::uint32_t> indices;
  for (const Triangle& triangle : mesh.triangles)
    for (const int i : triangle) indices.push_back(static_cast<std::uint32_t>(i));
  const auto normals = normals_of(points, indices);
  std::vector<double> values(mesh.triangles.size());
  for (const ClothPanel& panel : mesh.panels) {
    for (std::size_t t = panel.first; t < panel.first + panel.count; ++t) {
      const Slopes turns = slopes_of(mesh, t, [&](std::size_t k) -> Vector3d {
        const auto i = static_cast<std::size_t>(mesh.triangles[t][k]);
        return Eigen::Vector3f(normals[i].data()).cast<double>();
      });
      values[t] = energy_of(threads_of(mesh, t, points), turns, panel.textile.measured());
    }
  }
  return means_of(mesh, values, points.x.size());
}

}  // namespace weft::client

#include "client/imports/mesh_data.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace weft::client {
namespace {

static_assert(std::endian::native == std::endian::little, "the interface has such arrays");

template <class T>
void append(std::string& bytes, T value) {
  char own[sizeof value];
  std::memcpy(own, &value, sizeof value);
  bytes.append(own, sizeof value);
}

// float32, one component of all points after the other.
template <class Point>
std::string planes(const std::vector<Point>& points) {
  std::string bytes;
  for (Eigen::Index k = 0; k < Point::RowsAtCompileTime; ++k)
    for (const Point& point : points) append(bytes, static_cast<float>(point[k]));
  return bytes;
}

std::string indices(const Triangles& triangles) {
  std::string bytes;
  for (const auto& triangle : triangles)
    for (const int i : triangle) append(bytes, static_cast<std::uint32_t>(i));
  return bytes;
}

}  // namespace

v1::MeshData body_data(const ImportedMesh& mesh) {
  v1::MeshData data;
  data.set_positions_m(planes(mesh.positions));
  data.set_triangles(indices(mesh.triangles));
  return data;
}

v1::MeshData mesh_data(const ImportedMesh& mesh, double grain_rad) {
  v1::MeshData data = body_data(mesh);
  data.set_flat_m(planes(mesh.flat));
  if (mesh.corners != mesh.triangles) data.set_flat_triangles(indices(mesh.corners));
  for (std::size_t p = 0; p < mesh.panels.size(); ++p) {
    v1::Panel* panel = data.add_panels();
    panel->set_name(mesh.panels[p]);
    panel->set_triangle_count(
        static_cast<int>(std::ranges::count(mesh.panel, static_cast<int>(p))));
    panel->set_grain_rad(grain_rad);
  }
  return data;
}

}  // namespace weft::client

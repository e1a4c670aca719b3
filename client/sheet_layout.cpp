#include "client/sheet_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/message_values.h"
#include "client/output/text.h"

namespace weft::client {
namespace {

std::vector<std::array<float, 2>> corners_of(const v1::MeshData& mesh) {
  const auto planes = values_of<float>(mesh.flat_m());
  std::vector<std::array<float, 2>> corners(planes.size() / 2);
  for (std::size_t i = 0; i < corners.size(); ++i)
    corners[i] = {planes[i], planes[corners.size() + i]};
  return corners;
}

// Whether they are so many, of so many corners.
bool are_triangles(const std::string& bytes, std::size_t count, std::size_t corners) {
  if (bytes.size() != count * sizeof(Triangle)) return false;
  const auto indices = values_of<std::uint32_t>(bytes);
  return std::all_of(indices.begin(), indices.end(), [&](auto index) { return index < corners; });
}

SheetMesh mesh_of(const v1::SheetLayout& sheet, const v1::MeshData& from) {
  SheetMesh mesh{.layout = sheet,
                 .triangles = values_of<Triangle>(from.triangles()),
                 .flat = corners_of(from),
                 .flat_triangles = values_of<Triangle>(from.flat_triangles()),
                 .panels = {}};
  if (mesh.triangles.empty()) {
    v1::SheetLayout first = sheet;
    first.set_first_particle(0);
    for (const auto& [a, b, c, d] : quads_of(first)) {
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({c, d, b});
    }
  }
  if (mesh.flat_triangles.empty() && !mesh.flat.empty()) mesh.flat_triangles = mesh.triangles;
  std::size_t first = 0;
  for (const auto& panel : from.panels()) {
    const auto count = static_cast<std::size_t>(panel.triangle_count());
    mesh.panels.push_back({panel.name(), first, count, panel.grain_rad()});
    first += count;
  }
  if (mesh.panels.empty()) mesh.panels.push_back({sheet.name(), 0, mesh.triangles.size(), 0});
  return mesh;
}

}  // namespace

bool is_sound(const v1::SheetLayout& sheet) {
  if (sheet.rows() > 0 && sheet.columns() > 0) return true;
  return sheet.rows() == 0 && sheet.columns() == 0 && sheet.particle_count() > 0 &&
         sheet.triangle_count() > 0;
}

bool is_grid(const v1::SheetLayout& sheet) { return sheet.rows() > 0; }

bool needs_topology(const v1::Scene& scene) {
  return std::any_of(scene.sheets().begin(), scene.sheets().end(),
                     [](const v1::Sheet& sheet) { return sheet.has_triangles(); });
}

bool needs_topology(const v1::StreamHeader& header) {
  return !std::all_of(header.sheets().begin(), header.sheets().end(), is_grid);
}

std::size_t particle_count(const v1::SheetLayout& sheet) {
  if (!is_grid(sheet)) return static_cast<std::size_t>(sheet.particle_count());
  return static_cast<std::size_t>(sheet.rows()) * static_cast<std::size_t>(sheet.columns());
}

std::size_t triangle_count(const v1::SheetLayout& sheet) {
  if (!is_grid(sheet)) return static_cast<std::size_t>(sheet.triangle_count());
  return 2 * static_cast<std::size_t>(sheet.rows() - 1) *
         static_cast<std::size_t>(sheet.columns() - 1);
}

std::string simulated_text(int every) {
  return every > 1 ? fmt::format(", each {}. row and column simulated", every) : "";
}

std::string shape_text(const v1::SheetLayout& sheet) {
  if (is_grid(sheet))
    return fmt::format("{} x {} particles{}", sheet.rows(), sheet.columns(),
                       simulated_text(sheet.simulated_every()));
  return fmt::format("{}, {}", count_of(sheet.particle_count(), "particle"),
                     count_of(sheet.triangle_count(), "triangle"));
}

std::vector<Quad> quads_of(const v1::SheetLayout& sheet) {
  std::vector<Quad> quads;
  for (int row = 0; row + 1 < sheet.rows(); ++row) {
    for (int column = 0; column + 1 < sheet.columns(); ++column) {
      const int corner = sheet.first_particle() + row * sheet.columns() + column;
      const int below = corner + sheet.columns();
      quads.push_back({corner, below, below + 1, corner + 1});
    }
  }
  return quads;
}

std::vector<std::uint32_t> triangles_of(const std::vector<v1::SheetLayout>& sheets) {
  std::vector<std::uint32_t> triangles;
  for (const auto& sheet : sheets) {
    for (const Quad& quad : quads_of(sheet)) {
      for (const std::size_t corner : {0U, 1U, 2U, 0U, 2U, 3U})
        triangles.push_back(static_cast<std::uint32_t>(quad[corner]));
    }
  }
  return triangles;
}

GridPlace place_in(const v1::SheetLayout& sheet, int particle) {
  return {particle / sheet.columns(), particle % sheet.columns()};
}

bool is_sound(const v1::MeshData& mesh, const v1::SheetLayout& sheet) {
  if (is_grid(sheet) && mesh.triangles().empty()) return true;
  const std::size_t triangles = triangle_count(sheet);
  const auto flat = values_of<float>(mesh.flat_m());
  const std::size_t corners = flat.size() / 2;
  const bool own_corners = !mesh.flat_triangles().empty();
  std::int64_t in_panels = 0;
  for (const auto& panel : mesh.panels()) {
    if (panel.triangle_count() <= 0 || panel.name().empty()) return false;
    in_panels += panel.triangle_count();
  }
  // each edge is in one fold at most
  std::size_t in_folds = 0;
  for (const auto& fold : mesh.folds()) {
    in_folds += static_cast<std::size_t>(fold.particles_size());
    const auto is_there = [&](int i) {
      return i >= 0 && static_cast<std::size_t>(i) < particle_count(sheet);
    };
    if (fold.particles_size() < 2 || !std::isfinite(fold.angle_rad()) ||
        !std::all_of(fold.particles().begin(), fold.particles().end(), is_there))
      return false;
  }
  return in_folds <= 3 * triangles &&
         are_triangles(mesh.triangles(), triangles, particle_count(sheet)) &&
         mesh.flat_m().size() % (2 * sizeof(float)) == 0 &&
         std::all_of(flat.begin(), flat.end(), [](float value) { return std::isfinite(value); }) &&
         (own_corners ? are_triangles(mesh.flat_triangles(), triangles, corners)
                      : corners == particle_count(sheet)) &&
         (mesh.panels().empty() || in_panels == static_cast<std::int64_t>(triangles));
}

bool is_sound(const Topology& topology, const v1::StreamHeader& header) {
  if (topology.size() != static_cast<std::size_t>(header.sheets_size())) return false;
  for (int i = 0; i < header.sheets_size(); ++i)
    if (!is_sound(topology[static_cast<std::size_t>(i)], header.sheets(i))) return false;
  return true;
}

std::vector<SheetMesh> meshes_of(const v1::StreamHeader& header, const Topology& topology) {
  std::vector<SheetMesh> meshes;
  for (int i = 0; i < header.sheets_size(); ++i)
    meshes.push_back(mesh_of(header.sheets(i), topology[static_cast<std::size_t>(i)]));
  return meshes;
}

std::string shape_text(const SheetMesh& mesh) {
  if (is_grid(mesh.layout)) return shape_text(mesh.layout);
  return fmt::format("{}, {}", shape_text(mesh.layout),
                     count_of(static_cast<std::int64_t>(mesh.panels.size()), "panel"));
}

}  // namespace weft::client

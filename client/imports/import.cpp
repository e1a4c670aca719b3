#include "client/imports/import.h"

#include <fmt/format.h>

#include <algorithm>

#include "client/imports/gltf.h"
#include "client/imports/mend.h"
#include "client/imports/mesh_check.h"
#include "client/imports/obj.h"
#include "client/imports/stitches.h"
#include "client/input_file.h"
#include "client/output/text.h"

namespace weft::client {
namespace {

constexpr double kTolerance = 1e-6;  // within which points are equal, of the size

bool is_obj(const std::string& path) { return path.ends_with(".obj"); }

ImportedMesh read_mesh(const std::string& path, const std::string& bytes) {
  if (!is_mesh_file(path))
    throw malformed(path, "ends in neither .obj, .gltf nor .glb: export it as one of them");
  if (bytes.empty()) throw malformed(path, "is empty");
  return is_obj(path) ? read_obj(path, bytes) : read_gltf(path, bytes);
}

void place_in_space(ImportedMesh& mesh, const ImportOptions& options) {
  constexpr double kLarge = 10, kSmall = 0.01;  // m
  for (Vector3d& each : mesh.positions) {
    each *= options.unit_m;
    if (options.z_up) each = Vector3d(each.x(), each.z(), -each.y());
  }
  const double size = size_of(mesh.positions);
  if (size > kLarge)
    mesh.notes.push_back(fmt::format("it is {:.4g} m large, which looks like {}", size,
                                     size > 100 * kLarge ? "mm: --unit mm" : "cm: --unit cm"));
  if (size < kSmall)
    mesh.notes.push_back(fmt::format("it is {:.4g} mm large: see --unit", size * 1e3));
}

void note(ImportedMesh& mesh, int count, const char* thing, const char* done) {
  if (count > 0) mesh.notes.push_back(fmt::format("{} {}", count_of(count, thing), done));
}

double flat_size(const ImportedMesh& mesh) {
  double size = 0;
  for (const Vector2d& each : mesh.flat)
    size = std::max(size, (each - mesh.flat[0]).lpNorm<Eigen::Infinity>());
  return size;
}

// Points that are one, and the triangles that are none then.
void join_what_is_equal(ImportedMesh& mesh, bool of_gltf, bool mend) {
  if (of_gltf) join_points(mesh, 0);  // the format splits them where normals or UV differ
  const double tolerance = kTolerance * size_of(mesh.positions);
  if (mend) {
    note(mesh, join_points(mesh, tolerance), "point", "joined with the one that lies there too");
    note(mesh, drop_repeated_triangles(mesh), "triangle",
         "dropped that repeat another, or a point of their own");
    note(mesh, turn_triangles(mesh), "triangle", "turned to face as their neighbours do");
  } else if (!of_gltf) {
    ImportedMesh trial;
    trial.positions = mesh.positions;
    if (const int equal = join_points(trial, tolerance); equal > 0)
      mesh.notes.push_back(
          fmt::format("{} where another does, so the mesh is open there; --mend "
                      "joins them",
                      equal == 1 ? "1 point lies" : fmt::format("{} points lie", equal)));
  }
  join_corners(mesh, kTolerance * flat_size(mesh));
  const int unused = drop_unused_points(mesh);
  if (!mend || !of_gltf) note(mesh, unused, "point", "left out that no triangle has");
}

bool has_corner(const std::array<int, 3>& corners) {
  return std::ranges::find_if(corners, [](int i) { return i != kNoCorner; }) != corners.end();
}

// True where UV give the flat shape, false where its plane does.
bool find_flat_shape(const std::string& path, ImportedMesh& mesh) {
  if (std::ranges::any_of(mesh.corners, has_corner)) {
    const auto absent = [](const auto& corners) {
      return std::ranges::find(corners, kNoCorner) != corners.end();
    };
    if (std::ranges::any_of(mesh.corners, absent)) throw mesh_problem(path, find_faults(mesh));
    return true;
  }
  if (!flatten(mesh))
    throw malformed(path,
                    "has no UV, and does not lie in a plane: its flat shape is unknown. Unfold it "
                    "where it comes from (in Blender: seams, then UV > Unwrap), and export it with "
                    "UV");
  mesh.notes.emplace_back("it has no UV: its flat shape is the plane that it lies in");
  return false;
}

// Each piece of the flat shape is a panel, where the file names none.
void name_islands(ImportedMesh& mesh) {
  constexpr int kMost = 64;
  std::vector<int> island;
  const int count = find_islands(mesh, island);
  if (mesh.panels.size() != 1 || count < 2 || count > kMost) return;
  mesh.panels.clear();
  for (int i = 0; i < count; ++i) add_panel(mesh, fmt::format("piece-{}", i + 1));
  mesh.panel = std::move(island);
  mesh.panels_by = "piece of the UV";
}

// Of UV, by the panels that the mesh has now.
void find_scale_again(Import& import) {
  if (!import.has_uv) return;
  ScaleFound found = find_scale(import.mesh);
  for (double* ratio : {&found.median, &found.low, &found.high}) *ratio *= import.flat_scale;
  for (double& ratio : found.median_of_panel) ratio *= import.flat_scale;
  import.found = std::move(found);
}

void scale_flat_shape(const std::string& path, const ImportOptions& options, Import& import) {
  if (!import.has_uv) {
    if (options.flat_scale) throw usage_problem("--flat-scale: " + path + " has no UV to scale");
    return;
  }
  const double found = find_scale(import.mesh).median;
  if (found <= 0 && !options.flat_scale)
    throw malformed(path, "its UV have no lengths: all lie in one point");
  import.flat_scale = options.flat_scale.value_or(rounded_scale(found));
  for (Vector2d& each : import.mesh.flat) each *= import.flat_scale;
}

void mend_slivers(ImportedMesh& mesh) {
  const Collapse done = collapse_slivers(mesh);
  if (done.particles > 0)
    mesh.notes.push_back(fmt::format(
        "{} joined with a neighbour, for triangles were lower than {:.3g} mm; by {:.3g} mm in the "
        "flat shape at most, whose area is {:+.2g} % of it larger",
        count_of(done.particles, "particle"), done.height * 1e3, done.longest * 1e3,
        done.area_change * 100));
  if (done.left > 0)
    mesh.notes.push_back(fmt::format(
        "{} lower than {:.3g} mm {} left, at borders and seams or without a short edge",
        count_of(done.left, "triangle"), done.height * 1e3, done.left == 1 ? "is" : "are"));
  note(mesh, drop_empty_triangles(mesh), "triangle", "dropped that have no area");
}

void check(const std::string& path, const ImportedMesh& mesh) {
  if (mesh.triangles.empty()) throw malformed(path, "has no triangle left");
  for (const auto& find : {find_faults, find_flat_faults})
    if (const std::vector<Fault> faults = find(mesh); !faults.empty())
      throw mesh_problem(path, faults);
}

}  // namespace

bool is_mesh_file(const std::string& path) {
  return is_obj(path) || path.ends_with(".gltf") || path.ends_with(".glb");
}

Import import_mesh(const std::string& path, const std::string& bytes,
                   const ImportOptions& options) {
  Import import{read_mesh(path, bytes)};
  ImportedMesh& mesh = import.mesh;
  place_in_space(mesh, options);
  sew(mesh);
  join_what_is_equal(mesh, !is_obj(path), options.mend);

  import.has_uv = find_flat_shape(path, mesh);
  note(mesh, turn_mirrored_islands(mesh, options.grain_rad), "piece",
       "of the UV turned over: mirrored, it would be seen from its back");
  scale_flat_shape(path, options, import);
  if (options.mend) mend_slivers(mesh);

  check(path, mesh);
  drop_unused_points(mesh);
  if (mesh.panels_by.empty() || mesh.panels.size() == 1) name_islands(mesh);
  order_by_panel(mesh);
  join_corners(mesh, 0);
  find_scale_again(import);
  return import;
}

ImportedMesh import_body(const std::string& path, const ImportOptions& options) {
  ImportedMesh mesh = read_mesh(path, read_text(path));
  place_in_space(mesh, options);
  join_points(mesh, 0);
  drop_unused_points(mesh);
  if (mesh.triangles.empty()) throw malformed(path, "has no triangle");
  return mesh;
}

Import import_mesh(const std::string& path, const ImportOptions& options) {
  return import_mesh(path, read_text(path), options);
}

}  // namespace weft::client

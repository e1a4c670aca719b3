#include "core/triangles/warnings.h"

#include <algorithm>
#include <cmath>

#include "core/forces/membrane.h"
#include "core/model/text.h"
#include "core/motion/surface_bound.h"
#include "core/triangles/connections.h"
#include "core/triangles/rest_shape.h"
#include "core/triangles/triangles.h"

namespace weft {
namespace {

// "triangle 12 of panel front, at (u, v) = (0.1, 0.2) m of the flat shape"
std::string place_of(const TriangleMesh& mesh, std::size_t triangle, int panel) {
  const Vector2d middle = (flat_corner(mesh, triangle, 0) + flat_corner(mesh, triangle, 1) +
                           flat_corner(mesh, triangle, 2)) /
                          3;
  return join("triangle ", triangle, " of panel ",
              mesh.panels[static_cast<std::size_t>(panel)].name, ", at u = ", middle.x(),
              " m, v = ", middle.y(), " m of the flat shape,");
}

double least_height(const MembraneElement& element) {
  double steepest = 0;  // gradient of a corner's hat function: 1 / its height
  for (std::size_t k = 0; k < 3; ++k)
    steepest = std::max(steepest, std::hypot(element.du[k], element.dv[k]));
  return 1 / steepest;
}

// Where few triangles make the step of all.
void warn_of_slivers(const TriangleMesh& mesh, const Mesh& forces, const std::string& field,
                     Plan& plan) {
  const auto& membrane = forces.surface.membrane;
  if (membrane.size() < 2) return;
  const std::vector<double> steps = triangle_steps(forces, 0);
  std::vector<double> sorted = steps;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double median = *middle;
  const auto worst =
      static_cast<std::size_t>(std::min_element(steps.begin(), steps.end()) - steps.begin());
  constexpr double kSliver = 0.5;
  const auto slivers = std::count_if(steps.begin(), steps.end(),
                                     [&](double step) { return step < kSliver * median; });
  if (slivers == 0) return;
  plan.warnings.push_back(
      {"SLIVER", field,
       join(place_of(mesh, worst, membrane[worst].panel), " is ",
            1e3 * least_height(membrane[worst]), " mm high and bears a step ",
            median / steps[worst], " times shorter than most: all take so many more substeps. ",
            slivers, slivers == 1 ? " triangle bears" : " triangles bear",
            " less than half of the median step")});
}

void warn_of_size(const Scene& scene, const SheetDefinition& sheet, const Mesh& forces,
                  int limiting_particle, const std::string& field, Plan& plan) {
  if (!std::holds_alternative<MeasuredTextile>(sheet.textile.model)) return;
  const double given = scene.environment.gravity.norm();
  const double gravity = given > 0 ? given : kStandardGravity;
  const auto& textile = std::get<MeasuredTextile>(sheet.textile.model);
  const double softest = std::min(textile.bend_rigidity_warp, textile.bend_rigidity_weft);
  // radius to which its weight bends cloth
  const double radius = std::cbrt(softest / (textile.areal_density * gravity));
  if (softest > 0 && sheet.spacing() > radius)
    plan.warnings.push_back(
        {"MESH_TOO_COARSE", field,
         join("edges of ", 1e3 * sheet.spacing(), " mm are longer than ", 1e3 * radius,
              " mm, the radius to which its own weight bends this textile: folds will be wider "
              "than they are")});
  if (limiting_particle < 0 || forces.surface.fits.empty()) return;
  const SurfaceBound bound = surface_bound(forces, kBoundStrain);
  if (bound.bend[limiting_particle] > bound.membrane[limiting_particle])
    plan.warnings.push_back(
        {"MESH_TOO_FINE", field,
         join("with edges of ", 1e3 * sheet.spacing(),
              " mm bending, not tension, makes the step: it grows with the square of their "
              "length")});
}

// What edges make of a measured textile depends on the mesh.
void warn_of_connections(const SheetDefinition& sheet, std::size_t index, Plan& plan) {
  if (!std::holds_alternative<ChoiKo>(sheet.bending) ||
      !std::holds_alternative<MeasuredTextile>(sheet.textile.model))
    return;
  Mesh unused;
  const ConnectionError error = add_connections(sheet, rest_shape(triangles_in(sheet)), unused);
  plan.warnings.push_back(
      {"MESH_DEPENDENT", join("sheets[", index, "].bending.choi_ko"),
       join("connections along edges follow the mesh: by direction this sheet bends ",
            error.least_bend, " to ", error.most_bend, " times and stretches ", error.least_stretch,
            " to ", error.most_stretch, " times as measured; ISOMETRIC does as measured")});
}

void warn_of_compression(const Mesh& forces, const Matrix3Xd& x, const std::string& field,
                         Plan& plan) {
  constexpr double kMost = 0.2;  // from where St Venant-Kirchhoff's law gives way markedly
  const double least = (1 - kMost) * (1 - kMost);
  std::size_t shortened = 0;
  for (const MembraneElement& element : forces.surface.membrane) {
    const Threads thread = threads_of(element, x);
    shortened += thread.warp.squaredNorm() < least || thread.weft.squaredNorm() < least ? 1 : 0;
  }
  if (shortened > 0)
    plan.warnings.push_back(
        {"COMPRESSION_SOFTENS", field,
         join(shortened, " triangles are shortened by more than ", 100 * kMost,
              " % along warp or weft: the membrane resists that less and less, from 42 % on not "
              "at all")});
}

}  // namespace

void describe_surface(const SheetDefinition& sheet, const Mesh& mesh, Plan& plan) {
  const auto pass = [&](const char* name, std::size_t count, const char* of, const char* why_not) {
    if (count > 0)
      plan.passes.push_back(join(sheet.name, ": ", name, ", ", count, " ", of));
    else
      plan.skipped.push_back({join(sheet.name, ": ", name), why_not});
  };
  pass("membrane", mesh.surface.membrane.size(),
       mesh.surface.pushes ? "triangles that resist compression too" : "triangles",
       "its stiffness is 0");
  pass("bending", mesh.surface.fits.size(), "fitted curvatures", "the bending rigidity is 0");
}

void warn_of_triangles(const Scene& scene, std::size_t index, const PlannedSheet& planned,
                       int limiting_particle, Plan& plan) {
  const SheetDefinition& sheet = scene.sheets[index];
  const std::string field = join("sheets[", index, "].triangles");
  warn_of_slivers(triangles_in(sheet), planned.mesh, field, plan);
  warn_of_size(scene, sheet, planned.mesh, limiting_particle, field, plan);
  warn_of_compression(planned.mesh, planned.x, field, plan);
  warn_of_connections(sheet, index, plan);
}

}  // namespace weft

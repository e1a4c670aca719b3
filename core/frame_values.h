#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "core/contact/contact.h"
#include "core/contact/triangle_tree.h"
#include "core/model/mesh.h"

namespace weft {

struct MovingSheet;

// From the nearest collider of the scene, as contact sees it. bodies: placed for `time`.
Distance distance_from_any(const Scene& scene, const MovingBodies& bodies, const Vector3d& x,
                           double time);

// What colliders press each particle with, Pa: all that forces and weight push it towards one that
// it touches, over its area, a third of its triangles (of a grid a quarter of its cells). So it is
// for cloth at rest. bodies: placed for `time`; x: (3 x particles) m, of a sheet in that scene.
VectorXd pressures(const Scene& scene, const MovingBodies& bodies, const SheetDefinition& sheet,
                   const MovingSheet& moving, const Matrix3Xd& x, double time);

// What a frame's positions say of its sheets.
struct Deformation {
  double potential_energy = 0;  // elastic + gravity, 0 at the origin, J
  double largest_strain = 0;    // of the stretch connections
};
// x: (3 x particles) m, of the sheet.
void add(const MovingSheet& sheet, const Matrix3Xd& x, Deformation& deformation);

// Reads from frames of a simulation how cloth is deformed and meets colliders, whenever somebody
// asks: what it says follows from a frame's positions, and from textiles and colliders as they were
// then, to the bit. Thread-safe; those who ask wait for each other.
class FrameMeter {
 public:
  // Bodies and shapes of sheets are those of all scenes that follow.
  explicit FrameMeter(const Scene& scene);
  ~FrameMeter();

  // Of all sheets. scene, positions: as below.
  Deformation deformation(const std::shared_ptr<const Scene>& scene,
                          const std::vector<double>& positions, double time);
  // Of all sheets, one number of each particle. scene: as it was in the frame. positions: planes x,
  // y, z of all particles, m.
  std::vector<double> pressures(const std::shared_ptr<const Scene>& scene,
                                const std::vector<double>& positions, double time);  // Pa
  // From the surface of the nearest collider, m, negative inside; of bodies of triangles exactly.
  // Precondition: the scene has colliders.
  std::vector<double> clearances(const std::shared_ptr<const Scene>& scene,
                                 const std::vector<double>& positions, double time);

  // Until somebody asks again.
  void release_memory();
  // Meshes and trees made so far.
  int made() const;

 private:
  // The triangles of a body where it was last placed.
  struct Surface {
    BodyMesh mesh;
    std::unique_ptr<TriangleTree> tree;
    double time = 0;           // among its poses, s
    std::vector<int> nearest;  // triangle of each particle when it was last asked for, or -1
  };

  void take(const std::shared_ptr<const Scene>& scene, double time);
  // Calls f(sheet, x) with the positions of each, (3 x particles) m.
  template <class F>
  void for_each_sheet(const std::vector<double>& positions, const F& f) const;
  double clearance(const Scene& scene, const Vector3d& x, double time, std::size_t particle);
  const TriangleTree& tree_of(const Collider& collider, Surface& surface, double time);

  mutable std::mutex mutex_;
  // Of the scene that was last asked for; empty: not made.
  std::shared_ptr<const Scene> scene_;
  std::vector<SheetDefinition> definitions_;
  std::vector<MovingSheet> sheets_;
  MovingBodies bodies_;
  std::vector<Surface> surfaces_;  // of bodies of triangles, by collider
  int made_ = 0;
};

}  // namespace weft

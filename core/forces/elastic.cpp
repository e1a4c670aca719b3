#include "core/forces/elastic.h"

#include <algorithm>

#include "core/forces/curvature.h"
#include "core/forces/hinges.h"
#include "core/forces/membrane.h"
#include "core/forces/springs.h"

namespace weft {

void add_elastic_forces(const Mesh& mesh, const Matrix3Xd& x, const Matrix3Xd& v,
                        Matrix3Xd& force) {
  add_fast_forces(mesh, x, v, force);
  if (!mesh.stencils.empty()) add_isometric_forces(mesh, x, force);
}

void add_fast_forces(const Mesh& mesh, const Matrix3Xd& x, const Matrix3Xd& v, Matrix3Xd& force) {
  add_spring_forces(mesh, x, v, force);
  add_membrane_forces(mesh.surface, x, force);
  add_curvature_forces(mesh.surface, x, force);
  add_hinge_forces(mesh.surface.hinges, x, force);
}

double elastic_energy(const Mesh& mesh, const Matrix3Xd& x) {
  return spring_energy(mesh, x) + isometric_energy(mesh, x) + membrane_energy(mesh.surface, x) +
         curvature_energy(mesh.surface, x) + hinge_energy(mesh.surface.hinges, x);
}

double largest_strain(const Mesh& mesh, const Matrix3Xd& x) {
  return std::max(largest_spring_strain(mesh, x), largest_strain(mesh.surface, x));
}

}  // namespace weft

#include "core/forces/membrane.h"

#include <algorithm>
#include <cmath>

namespace weft {
namespace {

// Square of the length of its longer thread, that of the flat shape being 1.
double longest_squared(const MembraneElement& element, const Matrix3Xd& x) {
  const Threads thread = threads_of(element, x);
  return std::max(thread.warp.squaredNorm(), thread.weft.squaredNorm());
}

}  // namespace

Threads threads_of(const MembraneElement& element, const Matrix3Xd& x) {
  Threads sum;
  for (std::size_t k = 0; k < 3; ++k) {
    sum.warp += element.du[k] * x.col(element.particle[k]);
    sum.weft += element.dv[k] * x.col(element.particle[k]);
  }
  return sum;
}

MembraneStrain strain_of(const Threads& threads) {
  return {(threads.warp.squaredNorm() - 1) / 2, (threads.weft.squaredNorm() - 1) / 2,
          threads.warp.dot(threads.weft)};
}

MembraneStrain stress(const MembraneStiffness& stiffness, const MembraneStrain& strain,
                      bool pushes) {
  MembraneStrain s{stiffness.warp * strain.warp + stiffness.coupling * strain.weft,
                   stiffness.weft * strain.weft + stiffness.coupling * strain.warp,
                   stiffness.shear * strain.shear};
  if (!pushes) s.warp = std::max(s.warp, 0.0), s.weft = std::max(s.weft, 0.0);
  return s;
}

double membrane_energy(const Surface& surface, const Matrix3Xd& x) {
  double energy = 0;
  for (const MembraneElement& element : surface.membrane) {
    const MembraneStrain e = strain_of(threads_of(element, x));
    const MembraneStrain s =
        stress(surface.stretch[static_cast<std::size_t>(element.panel)], e, surface.pushes);
    energy += element.area / 2 * (s.warp * e.warp + s.weft * e.weft + s.shear * e.shear);
  }
  return energy;
}

void add_membrane_forces(const Surface& surface, const Matrix3Xd& x, Matrix3Xd& force) {
  for (const MembraneElement& element : surface.membrane) {
    const Threads thread = threads_of(element, x);
    const MembraneStrain s = stress(surface.stretch[static_cast<std::size_t>(element.panel)],
                                    strain_of(thread), surface.pushes);
    const Vector3d along_warp = element.area * (s.warp * thread.warp + s.shear * thread.weft);
    const Vector3d along_weft = element.area * (s.weft * thread.weft + s.shear * thread.warp);
    for (std::size_t k = 0; k < 3; ++k)
      force.col(element.particle[k]) -= element.du[k] * along_warp + element.dv[k] * along_weft;
  }
}

double largest_strain(const Surface& surface, const Matrix3Xd& x) {
  double squared = 1;
  for (const MembraneElement& element : surface.membrane)
    squared = std::max(squared, longest_squared(element, x));
  return std::sqrt(squared) - 1;
}

VectorXd largest_strains(const Surface& surface, const Matrix3Xd& x) {
  VectorXd strains(static_cast<Eigen::Index>(surface.membrane.size()));
  for (Eigen::Index t = 0; const MembraneElement& element : surface.membrane)
    strains[t++] = std::sqrt(std::max(1.0, longest_squared(element, x))) - 1;
  return strains;
}

}  // namespace weft

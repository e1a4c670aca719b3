#pragma once

#include <vector>

#include "core/model/mesh.h"

namespace weft {

// Strains of a triangle, Green's: with U = sum du_i x_i and V = sum dv_i x_i, (U.U - 1) / 2,
// (V.V - 1) / 2 and U.V.
struct MembraneStrain {
  double warp = 0, weft = 0, shear = 0;
};

// Deformed unit vectors of warp and weft, U and V.
struct Threads {
  Vector3d warp = Vector3d::Zero(), weft = Vector3d::Zero();
};
Threads threads_of(const MembraneElement& element, const Matrix3Xd& x);
MembraneStrain strain_of(const Threads& threads);

// Forces in the sheet, per width, N/m; without `pushes` none where it is shortened.
MembraneStrain stress(const MembraneStiffness& stiffness, const MembraneStrain& strain,
                      bool pushes);

// Orthotropic St Venant-Kirchhoff (Volino, Magnenat-Thalmann and Faure 2009), energy per area
// E_u e_u^2 / 2 + E_v e_v^2 / 2 + E_uv e_u e_v + G g^2 / 2. Shortened, it softens: at 42 % it
// resists no more. x: (3 x particles) m. J, and N added to `force`.
double membrane_energy(const Surface& surface, const Matrix3Xd& x);
void add_membrane_forces(const Surface& surface, const Matrix3Xd& x, Matrix3Xd& force);

// Largest l / L - 1 of a thread of warp or weft, 0 where none is stretched: of all triangles, and
// of each.
double largest_strain(const Surface& surface, const Matrix3Xd& x);
VectorXd largest_strains(const Surface& surface, const Matrix3Xd& x);

}  // namespace weft

#pragma once

#include <vector>

#include "core/triangles/rest_shape.h"

namespace weft {

// Stiffness of a sheet in its plane, N/m.
struct MembraneStiffness {
  double warp = 0, weft = 0;
  double coupling = 0;  // of strain along the warp with that along the weft
  double shear = 0;
};

// A triangle, with the gradients of its corners' hat functions in (u, v).
struct MembraneElement {
  std::array<int, 3> particle{};
  std::array<double, 3> du{}, dv{};  // 1/m
  double area = 0;                   // m^2
};

std::vector<MembraneElement> make_membrane(const RestShape& shape);

// Strains of a triangle, Green's: with U = sum du_i x_i and V = sum dv_i x_i, (U.U - 1) / 2,
// (V.V - 1) / 2 and U.V.
struct MembraneStrain {
  double warp = 0, weft = 0, shear = 0;
};
MembraneStrain strain(const MembraneElement& element, const Matrix3Xd& x);

// Orthotropic St Venant-Kirchhoff (Volino, Magnenat-Thalmann and Faure 2009), per area E_u e_u^2 /
// 2
// + E_v e_v^2 / 2 + E_uv e_u e_v + G g^2 / 2. Shortened, it softens: at 42 % it resists no more. x:
// (3 x particles) m. J, and N added to `force`.
double membrane_energy(const std::vector<MembraneElement>& elements,
                       const MembraneStiffness& stiffness, const Matrix3Xd& x);
void add_membrane_forces(const std::vector<MembraneElement>& elements,
                         const MembraneStiffness& stiffness, const Matrix3Xd& x, Matrix3Xd& force);

}  // namespace weft

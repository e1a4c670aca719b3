#include "core/triangles/membrane.h"

namespace weft {
namespace {

// Deformed unit vectors of warp and weft.
struct Threads {
  Vector3d warp = Vector3d::Zero(), weft = Vector3d::Zero();
};

Threads threads(const MembraneElement& element, const Matrix3Xd& x) {
  Threads sum;
  for (std::size_t k = 0; k < 3; ++k) {
    sum.warp += element.du[k] * x.col(element.particle[k]);
    sum.weft += element.dv[k] * x.col(element.particle[k]);
  }
  return sum;
}

MembraneStrain strain(const Threads& threads) {
  return {(threads.warp.squaredNorm() - 1) / 2, (threads.weft.squaredNorm() - 1) / 2,
          threads.warp.dot(threads.weft)};
}

// Forces in the sheet, per width, N/m.
MembraneStrain stress(const MembraneStiffness& stiffness, const MembraneStrain& e) {
  return {stiffness.warp * e.warp + stiffness.coupling * e.weft,
          stiffness.weft * e.weft + stiffness.coupling * e.warp, stiffness.shear * e.shear};
}

}  // namespace

std::vector<MembraneElement> make_membrane(const RestShape& shape) {
  std::vector<MembraneElement> elements;
  elements.reserve(shape.triangles.size());
  for (std::size_t t = 0; t < shape.triangles.size(); ++t) {
    const auto& corner = shape.corners[t];
    MembraneElement& element = elements.emplace_back();
    element.particle = shape.triangles[t];
    element.area = area(corner);
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector2d opposite = corner[(k + 1) % 3] - corner[(k + 2) % 3];
      element.du[k] = opposite.y() / (2 * element.area);
      element.dv[k] = -opposite.x() / (2 * element.area);
    }
  }
  return elements;
}

MembraneStrain strain(const MembraneElement& element, const Matrix3Xd& x) {
  return strain(threads(element, x));
}

double membrane_energy(const std::vector<MembraneElement>& elements,
                       const MembraneStiffness& stiffness, const Matrix3Xd& x) {
  double energy = 0;
  for (const MembraneElement& element : elements) {
    const MembraneStrain e = strain(element, x), s = stress(stiffness, e);
    energy += element.area / 2 * (s.warp * e.warp + s.weft * e.weft + s.shear * e.shear);
  }
  return energy;
}

void add_membrane_forces(const std::vector<MembraneElement>& elements,
                         const MembraneStiffness& stiffness, const Matrix3Xd& x, Matrix3Xd& force) {
  for (const MembraneElement& element : elements) {
    const Threads thread = threads(element, x);
    const MembraneStrain s = stress(stiffness, strain(thread));
    const Vector3d along_warp = element.area * (s.warp * thread.warp + s.shear * thread.weft);
    const Vector3d along_weft = element.area * (s.weft * thread.weft + s.shear * thread.warp);
    for (std::size_t k = 0; k < 3; ++k)
      force.col(element.particle[k]) -= element.du[k] * along_warp + element.dv[k] * along_weft;
  }
}

}  // namespace weft

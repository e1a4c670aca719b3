#include "core/forces/springs.h"

#include <algorithm>
#include <cmath>

namespace weft {
namespace {

// One sweep over a family: pull(length) is the tension at that length, where active(length) holds.
template <class Active, class Pull>
void add_family(const Family& family, double damping, const Matrix3Xd& x, const Matrix3Xd& v,
                Matrix3Xd& force, const Active& active, const Pull& pull) {
  for (const auto& [i, j] : family.connections) {
    const Vector3d x_ij = x.col(j) - x.col(i);
    const double squared = x_ij.squaredNorm();
    Vector3d f = Vector3d::Zero();
    if (active(squared)) {
      const double length = std::sqrt(squared);
      f = pull(length) / length * x_ij;
    }
    if (damping > 0) f += damping * (v.col(j) - v.col(i));
    force.col(i) += f;
    force.col(j) -= f;
  }
}

Vector3d weighted_sum(const Stencil& stencil, const Matrix3Xd& x) {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) sum += stencil.weight[k] * x.col(stencil.particle[k]);
  return sum;
}

}  // namespace

void add_spring_forces(const Mesh& mesh, const Matrix3Xd& x, const Matrix3Xd& v, Matrix3Xd& force) {
  for (const Family& family : mesh.families) {
    const double rest = family.rest_length, squared_rest = rest * rest;
    if (family.bend) {
      // two particles in one place have no direction to push in
      const auto active = [&](double squared) { return squared < squared_rest && squared > 0; };
      std::visit(
          [&](const auto& g) {
            add_family(family, mesh.damping, x, v, force, active,
                       [&](double length) { return family.bend->force(g, length); });
          },
          family.bend->function());
    } else {
      const bool pulls = family.stiffness > 0;
      const auto active = [&](double squared) {
        return pulls && (squared >= squared_rest || (family.pushes && squared > 0));
      };
      add_family(family, mesh.damping, x, v, force, active,
                 [&](double length) { return family.stiffness * (length - rest); });
    }
  }
}

double spring_energy(const Mesh& mesh, const Matrix3Xd& x) {
  double energy = 0;
  for (const Family& family : mesh.families) {
    const auto add = [&](const auto& of_length) {
      for (const auto& [i, j] : family.connections)
        energy += of_length((x.col(j) - x.col(i)).norm());
    };
    if (family.bend) {
      std::visit(
          [&](const auto& g) {
            add([&](double length) { return family.bend->energy(g, length); });
          },
          family.bend->function());
    } else {
      const double slack = family.pushes ? -family.rest_length : 0;
      add([&](double length) {
        const double stretch = std::max(slack, length - family.rest_length);
        return family.stiffness / 2 * stretch * stretch;
      });
    }
  }
  return energy;
}

double largest_spring_strain(const Mesh& mesh, const Matrix3Xd& x) {
  double strain = 0;
  for (const Family& family : mesh.families) {
    if (family.kind != FamilyKind::kStretch) continue;
    double squared = 0;
    for (const auto& [i, j] : family.connections)
      squared = std::max(squared, (x.col(j) - x.col(i)).squaredNorm());
    strain = std::max(strain, std::sqrt(squared) / family.rest_length - 1);
  }
  return strain;
}

void add_isometric_forces(const Mesh& mesh, const Matrix3Xd& x, Matrix3Xd& force) {
  for (const Stencil& stencil : mesh.stencils) {
    const Vector3d pull = -stencil.stiffness * weighted_sum(stencil, x);
    for (std::size_t k = 0; k < 4; ++k) force.col(stencil.particle[k]) += stencil.weight[k] * pull;
  }
}

double isometric_energy(const Mesh& mesh, const Matrix3Xd& x) {
  double energy = 0;
  for (const Stencil& stencil : mesh.stencils)
    energy += stencil.stiffness / 2 * weighted_sum(stencil, x).squaredNorm();
  return energy;
}

}  // namespace weft

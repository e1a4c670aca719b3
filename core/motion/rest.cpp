#include "core/motion/rest.h"

namespace weft {

bool is_quiet(const Mesh& mesh, const VectorXd& inverse_mass, const Drive& drive, double height,
              const SheetState& before, const SheetState& after, bool by_frame) {
  constexpr double kEnergyShare = 1e-6, kForceShare = 0.01;
  const double given = drive.gravity.norm();
  const double gravity = given > 0 ? given : kStandardGravity;
  const double most_change = kForceShare * gravity * drive.frame_step;
  const double most_energy = kEnergyShare * mesh.mass.sum() * gravity * height;
  double energy = 0, squares = 0;
  int free = 0;
  for (Eigen::Index i = 0; i < after.v.cols(); ++i) {
    if (inverse_mass[i] == 0) continue;
    Vector3d v = after.v.col(i);
    if (by_frame)
      v = (after.x.col(i) - before.x.col(i)) / drive.frame_step;
    else
      squares += (v - before.v.col(i)).squaredNorm();
    energy += mesh.mass[i] / 2 * v.squaredNorm();
    if (energy > most_energy) return false;
    ++free;
  }
  return squares <= free * most_change * most_change && energy <= most_energy;
}

}  // namespace weft

#include "core/motion/energy_budget.h"

#include <algorithm>
#include <cmath>

#include "core/forces/elastic.h"
#include "core/model/text.h"

namespace weft {

double work_of_motion(const Mesh& mesh, const Drive& drive, double stored) {
  if (drive.speed == 0) return 0;
  double stiffness = 0;
  for (const Family& family : mesh.families)
    if (!family.bend)
      stiffness += family.stiffness * static_cast<double>(family.connections.size());
  for (const MembraneElement& element : mesh.surface.membrane) {
    const MembraneStiffness& k = mesh.surface.stretch[static_cast<std::size_t>(element.panel)];
    for (std::size_t c = 0; c < 3; ++c)
      stiffness += element.area * ((k.warp + k.coupling + k.shear) * element.du[c] * element.du[c] +
                                   (k.weft + k.coupling + k.shear) * element.dv[c] * element.dv[c]);
  }
  const double way = drive.speed * drive.frame_step;
  const double root = std::sqrt(stored) + way * std::sqrt(2 * stiffness);
  return root * root - stored +
         mesh.mass.sum() * (drive.gravity.norm() * way + drive.speed * drive.speed);
}

std::string audit(const Mesh& mesh, const Drive& drive, double height, double wind, double others,
                  const SheetState& state, EnergyBudget& budget) {
  // shares of what is stored, and of m g h: what readings of fast modes differ by, and rounding
  constexpr double kStoredShare = 0.05, kWeightShare = 1e-6;
  constexpr double kWindShare = 20;  // of M u^2, what a wind can bring a sheet to
  const double mass = mesh.mass.sum();
  const double stored = state.kinetic_energy + elastic_energy(mesh, state.x);
  const double energy = stored - mesh.mass.dot(state.x.transpose() * drive.gravity);
  budget.substeps = 0;
  budget.stored = std::max(budget.stored, stored);
  if (std::isinf(budget.limit)) budget.limit = energy + stored;
  budget.least = budget.audits == 0 ? energy : std::min(budget.least, energy);
  budget.most = budget.audits == 0 ? energy : std::max(budget.most, energy);
  if (++budget.audits < kAudits) return {};

  const double given = budget.given + others + kWindShare * mass * wind * wind;
  const double tolerance =
      kStoredShare * budget.stored +
      mass * (kWeightShare * drive.gravity.norm() * height + kStillSpeed * kStillSpeed);
  std::string reason;
  if (budget.least > budget.limit + given + tolerance)
    reason = join("energy rose by ", budget.least - budget.limit, " J in ", kAudits,
                  " audits, of which motion and wind explain ", given, " J");
  budget.limit = std::min(budget.limit + given, budget.most);
  budget.audits = 0;
  budget.given = 0;
  return reason;
}

}  // namespace weft

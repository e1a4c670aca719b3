#pragma once

#include <cstdint>
#include <limits>
#include <string>

#include "core/motion/guard.h"

namespace weft {

// What a sheet's energy is held to over time, in plain values. Energy that grows by little in every
// frame passes the guard of frames; here it adds up. The sheet is audited every kAuditSubsteps at
// the end of a frame; over a block of kAudits, its least energy must not lie above the largest of
// the block before by more than was put in. The first block may double what is stored: fast modes
// read as more than they are.
struct EnergyBudget {
  std::int64_t substeps = 0;   // since the last audit
  int audits = 0;              // of this block
  double least = 0, most = 0;  // energies of this block, J
  double given = 0;            // put in since the block before, at most, J
  double limit = std::numeric_limits<double>::infinity();  // largest of the block before, J
  double stored = 0;  // largest kinetic and elastic energy so far, J

  bool operator==(const EnergyBudget&) const = default;
};
inline constexpr std::int64_t kAuditSubsteps = 1024;
inline constexpr int kAudits = 4;

// What bodies and pins at the speed of the drive can put into a sheet in a frame, J. With s the
// distance, K the sum of its stiffnesses and U its elastic energy, at most the work on U' = K s^2 /
// 2 in phase with U, and what brings its mass M to that speed.
double work_of_motion(const Mesh& mesh, const Drive& drive, double stored);

// Looks at the energy of a sheet after a frame. `height`: of the sheet, m; `wind`: its speed, m/s;
// `others`: what sheets that touch it may have had, J. Returns why the step is not to be trusted;
// empty: nothing speaks against it.
std::string audit(const Mesh& mesh, const Drive& drive, double height, double wind, double others,
                  const SheetState& state, EnergyBudget& budget);

}  // namespace weft

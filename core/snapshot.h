#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/model/actions.h"
#include "core/model/mesh.h"
#include "core/motion/energy_budget.h"
#include "core/motion/relaxation.h"
#include "core/repairs.h"

namespace weft {

// A simulation between two frames, as plain values: all that its later frames depend on beside the
// scene, and what it shows of itself.
struct Snapshot {
  struct Sheet {
    Textile textile;         // of the frame
    double most_strain = 0;  // that the guard allows
    Matrix3Xd x, v;          // (3 x particles) m, m/s
    std::string solver;      // SheetSolver::save()
    std::optional<TextileRamp> ramp = {};
    EnergyBudget budget = {};
  };
  std::int64_t frame = 0;
  std::int64_t substeps = 0;  // that the frame took
  int frames_at_rest = 0;
  int halvings = 0;  // of the planned step
  Plan plan;
  std::vector<Repair> repairs;  // all so far
  std::vector<Sheet> sheets;
  Constraints constraints;
  std::optional<Relaxation> relaxation = {};
};

// Whether a simulation of the scene, whatever its textiles are, could have been there.
bool fits(const Scene& scene, const Snapshot& snapshot);

}  // namespace weft

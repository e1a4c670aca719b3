#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/model/mesh.h"
#include "core/motion/tethers.h"

namespace weft {

// The largest stable step of a scene, and the one taken. Lengths in s.
struct StepPlan {
  std::int64_t substeps = 1;   // a frame
  double substep = 0;          // frame step / substeps
  double linear_bound = 0;     // for every shape; 0: none
  double estimated_bound = 0;  // for the present shape
  double damping_ratio = 0;    // of the stiffest mode
  std::string limiting_sheet;
  double unsheared_bound = 0;  // for shapes that shear little; 0: not asked for
  int slow_every = 1;          // substeps in one of which slow forces act, at most

  // How many times as strongly slow forces act in substep k of a frame: amid so many substeps, for
  // all of which they stand, or 0. Amid as many that are odd they act half a substep early and late
  // in turns.
  int slow_in(std::int64_t k) const;

  // The longest that is not refused, s.
  double longest() const { return std::max(linear_bound, unsheared_bound); }
};

struct SkippedPass {
  std::string pass;
  std::string reason;
};

struct Warning {
  std::string code;   // one of warning_codes()
  std::string field;  // path in a scene file; empty: the whole scene
  std::string message;
};

std::span<const std::string_view> warning_codes();

// Where interlaced connections bend a sheet as its rigidity says, and where they no longer do.
struct BendingLimit {
  std::string sheet;
  double least_curvature = 0;  // kappa*, 1/m: a sheet that is less bent resists too little
  double finest_spacing = 0;   // h_min, m, for the curvature that weight gives the textile
};

// What resisting stretch costs: steps grow with the root of this strain.
struct StretchCost {
  std::string sheet;
  double self_weight_strain = 0;  // as given; the larger one of warp and weft
};

// Internal damping as a sheet has it.
struct SheetDamping {
  std::string sheet;
  double damping = 0;  // k_d, kg/s
  double ratio = 0;    // of its stiffest mode; infinity where nothing is stiff
};

// What a scene needs: derived once, before the run.
struct Plan {
  StepPlan step;
  std::vector<std::string> passes;
  std::vector<SkippedPass> skipped;
  std::vector<BendingLimit> bending_limits;  // of sheets with CHOI_KO bending
  std::vector<StretchCost> stretch_costs;
  std::vector<SheetDamping> dampings;
  std::vector<Warning> warnings;
  double particle_substeps = 0;  // of a simulated second
};

// Most substeps of a frame that are ever run.
inline constexpr std::int64_t kMaxSubsteps = 1'000'000;

// Why a plan cannot be run.
struct StepRefusal {
  double asked = 0;                // s
  double bound = 0;                // s
  bool too_many_substeps = false;  // else: asked lies above the linear bound
  std::int64_t substeps = 0;       // of a frame
  std::int64_t most_substeps = kMaxSubsteps;
};
std::optional<StepRefusal> find_refusal(const StepPlan& step, const SolverSettings& solver,
                                        std::int64_t most_substeps = kMaxSubsteps);

// What a plan looks at in a sheet.
struct PlannedSheet {
  const Mesh& mesh;
  const VectorXd& inverse_mass;  // (particles) 1/kg, 0: held
  const Matrix3Xd& x;            // (3 x particles) m
  const Tethers& tethers;
};

// sheets: those of the scene, in order.
Plan make_plan(const Scene& scene, const std::vector<PlannedSheet>& sheets);

}  // namespace weft

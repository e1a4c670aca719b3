#include "core/snapshot.h"

#include <algorithm>

#include "core/motion/guard.h"

namespace weft {
namespace {

bool fits(const Scene& scene, const StepPlan& step, int halvings) {
  const bool halved = halvings >= 0 && halvings <= scene.solver.max_repairs && halvings < 32 &&
                      step.substeps % (std::int64_t{1} << halvings) == 0;
  return halved && step.substeps >= 1 &&
         step.substep == scene.solver.frame_step / static_cast<double>(step.substeps) &&
         !find_refusal(step, scene.solver);
}

bool fits(const TextileRamp& ramp, std::int64_t frame) {
  return ramp.begin <= frame && frame < ramp.end &&
         ramp.from.model.index() == ramp.to.model.index() && find_problems(ramp.from, "").empty() &&
         find_problems(ramp.to, "").empty();
}

bool fits(const SheetDefinition& definition, const Snapshot::Sheet& sheet, std::int64_t frame) {
  if (sheet.ramp && !fits(*sheet.ramp, frame)) return false;
  return sheet.x.cols() == definition.particle_count() && sheet.v.cols() == sheet.x.cols() &&
         sheet.x.allFinite() && sheet.v.allFinite() && sheet.most_strain >= kMostStrain;
}

bool fits(const Collider& collider, const std::optional<PoseLead>& lead) {
  if (!lead) return true;
  if (!collider.poses) return false;
  const auto& times = collider.poses->times;
  const auto within = [&](double time) { return time >= times.front() && time <= times.back(); };
  return lead->begin >= 0 && lead->end >= lead->begin && within(lead->from) && within(lead->to);
}

bool fits(const Scene& scene, const Constraints& constraints) {
  const auto& leads = constraints.leads;
  return constraints.pins.size() == scene.sheets.size() &&
         constraints.paths.size() == scene.colliders.size() &&
         std::equal(scene.colliders.begin(), scene.colliders.end(), leads.begin(), leads.end(),
                    [](const auto& collider, const auto& lead) { return fits(collider, lead); }) &&
         std::all_of(constraints.grips.begin(), constraints.grips.end(), [&](const Grip& grip) {
           return grip.sheet < scene.sheets.size() && grip.particle >= 0 &&
                  grip.particle < scene.sheets[grip.sheet].particle_count();
         });
}

}  // namespace

bool fits(const Scene& scene, const Snapshot& snapshot) {
  if (snapshot.sheets.size() != scene.sheets.size() || snapshot.frame < 0 ||
      snapshot.substeps < 0 || snapshot.frames_at_rest < 0 || !fits(scene, snapshot.constraints))
    return false;
  for (std::size_t s = 0; s < scene.sheets.size(); ++s)
    if (!fits(scene.sheets[s], snapshot.sheets[s], snapshot.frame)) return false;
  if (snapshot.relaxation && snapshot.plan.dampings.size() != scene.sheets.size()) return false;
  return fits(scene, snapshot.plan.step, snapshot.halvings);
}

}  // namespace weft

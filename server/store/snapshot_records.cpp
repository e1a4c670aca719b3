#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/convert/convert.h"
#include "server/convert/numerics.h"
#include "server/session/snapshot.h"
#include "server/store/records.h"
#include "weft/storage/v1/storage.pb.h"

namespace weft::records {
namespace {

namespace stored = storage::v1;

Plan plan_of(const v1::Plan& from) {
  Plan plan;
  plan.step = {from.substeps_per_frame(), from.substep_s(),
               from.linear_bound_s(),     from.estimated_bound_s(),
               from.damping_ratio(),      from.limiting_sheet(),
               from.unsheared_bound_s(),  std::max(1, from.slow_forces_every())};
  plan.passes.assign(from.passes().begin(), from.passes().end());
  for (const auto& each : from.skipped()) plan.skipped.push_back({each.pass(), each.reason()});
  for (const auto& each : from.warnings())
    plan.warnings.push_back({each.code(), each.field(), each.message()});
  for (const auto& each : from.bending_limits())
    plan.bending_limits.push_back(
        {each.sheet(), each.least_curvature_per_m(), each.finest_spacing_m()});
  for (const auto& each : from.stretch_costs())
    plan.stretch_costs.push_back({each.sheet(), each.self_weight_strain()});
  for (const auto& each : from.dampings())
    plan.dampings.push_back({each.sheet(), each.damping_kg_per_s(), each.damping_ratio()});
  plan.particle_substeps = from.particle_substeps_per_second();
  return plan;
}

Textile textile_of(const v1::Textile& from) {
  auto converted = to_textile(from, "textile");
  if (const auto* problems = std::get_if<std::vector<Problem>>(&converted))
    throw StoreError(problems->front().field + ": " + problems->front().message);
  return std::get<Textile>(converted);
}

Matrix3Xd columns_of(const google::protobuf::RepeatedField<double>& from) {
  if (from.size() % 3 != 0) throw StoreError("no whole number of particles");
  return Eigen::Map<const Matrix3Xd>(from.data(), 3, from.size() / 3);
}

void set(stored::KeptSheet* to, const Snapshot::Sheet& from, const std::vector<Pin>& pins) {
  *to->mutable_textile() = as_given(from.textile);
  to->set_most_strain(from.most_strain);
  to->mutable_positions_m()->Add(from.x.data(), from.x.data() + from.x.size());
  to->mutable_velocities_m_per_s()->Add(from.v.data(), from.v.data() + from.v.size());
  to->set_solver(from.solver);
  if (from.ramp) {
    stored::KeptRamp* ramp = to->mutable_ramp();
    *ramp->mutable_from() = as_given(from.ramp->from);
    *ramp->mutable_to() = as_given(from.ramp->to);
    ramp->set_begin(from.ramp->begin);
    ramp->set_end(from.ramp->end);
  }
  stored::KeptBudget* budget = to->mutable_budget();
  budget->set_substeps(from.budget.substeps);
  budget->set_audits(from.budget.audits);
  budget->set_least_j(from.budget.least);
  budget->set_most_j(from.budget.most);
  budget->set_given_j(from.budget.given);
  budget->set_limit_j(from.budget.limit);
  budget->set_stored_j(from.budget.stored);
  for (const Pin& pin : pins) *to->add_pins() = to_proto(pin);
}

EnergyBudget budget_of(const stored::KeptBudget& from) {
  return {.substeps = from.substeps(),
          .audits = from.audits(),
          .least = from.least_j(),
          .most = from.most_j(),
          .given = from.given_j(),
          .limit = from.limit_j(),
          .stored = from.stored_j()};
}

void set(stored::KeptRelaxation* to, const Relaxation& from) {
  to->set_begun(from.begun);
  to->set_ended(from.ended);
  to->set_standing(from.standing);
  to->set_energy_j(from.energy);
  if (from.residual) to->set_residual(*from.residual);
  to->set_least_residual(from.least);
  to->set_stalls(from.stalls);
  to->set_settling(from.settling);
}

Relaxation relaxation_of(const stored::KeptRelaxation& from) {
  return {.begun = from.begun(),
          .ended = from.ended(),
          .standing = from.standing(),
          .energy = from.energy_j(),
          .residual = from.has_residual() ? std::optional(from.residual()) : std::nullopt,
          .least = from.least_residual(),
          .stalls = from.stalls(),
          .settling = from.settling()};
}

void set(stored::KeptPath* to, const Path& path, const std::optional<PoseLead>& lead) {
  *to->mutable_path() = to_proto(path);
  if (!lead) return;
  stored::KeptPoseLead* kept = to->mutable_lead();
  kept->set_begin_s(lead->begin);
  kept->set_end_s(lead->end);
  kept->set_from_s(lead->from);
  kept->set_to_s(lead->to);
}

// Plans that a snapshot shares, each once.
class Plans {
 public:
  explicit Plans(stored::KeptSnapshot& to) : to_(to) {}

  int add(const std::shared_ptr<const Plan>& plan) {
    // a change is seldom, and the next answers have the same plan
    const auto found = std::find(known_.rbegin(), known_.rend(), plan);
    if (found != known_.rend()) return static_cast<int>(known_.rend() - found);
    *to_.add_plans() = to_proto(*plan);
    known_.push_back(plan);
    return static_cast<int>(known_.size());
  }

 private:
  stored::KeptSnapshot& to_;
  std::vector<std::shared_ptr<const Plan>> known_;  // from index 1 on
};

void set(stored::KeptAnswer* to, const SessionSnapshot::Answered& from, Plans& plans) {
  to->set_request_id(from.request.id);
  to->set_request_checksum(from.request.checksum);
  if (const auto* refusal = std::get_if<Refusal>(&from.outcome)) {
    to->set_interrupted(true);
    to->set_frame(refusal->frame);
    return;
  }
  const auto& applied = std::get<Applied>(from.outcome);
  to->set_applied_frame(applied.frame);
  to->set_frame(applied.newest);
  to->set_time_s(applied.time);
  to->set_at_rest(applied.at_rest);
  if (applied.textile != Textile()) *to->mutable_textile() = as_given(applied.textile);
  to->set_plan(plans.add(applied.plan));
}

Outcome outcome_of(const stored::KeptAnswer& from,
                   const std::vector<std::shared_ptr<const Plan>>& plans) {
  if (from.interrupted()) return Refusal{Refusal::Why::kInterrupted, from.frame(), {}, {}, {}};
  const auto plan = static_cast<std::size_t>(from.plan());
  if (from.plan() < 0 || plan >= plans.size()) throw StoreError("an answer without a plan");
  return Applied{from.applied_frame(),
                 from.frame(),
                 from.time_s(),
                 from.at_rest(),
                 from.has_textile() ? textile_of(from.textile()) : Textile(),
                 plans[plan]};
}

}  // namespace

std::string encode(const std::string& uid, const SessionSnapshot& snapshot) {
  const Snapshot& simulation = snapshot.simulation;
  stored::KeptSnapshot to;
  to.set_uid(uid);
  to.set_numerics_id(numerics_id());
  to.set_entries(snapshot.entries);
  *to.mutable_create_time() = timestamp_of(snapshot.create_time);
  to.set_frame(simulation.frame);
  to.set_substeps(simulation.substeps);
  to.set_frames_at_rest(simulation.frames_at_rest);
  to.set_halvings(simulation.halvings);
  for (const Repair& repair : simulation.repairs) *to.add_repairs() = to_proto(repair);
  const Constraints& constraints = simulation.constraints;
  for (std::size_t s = 0; s < simulation.sheets.size(); ++s)
    set(to.add_sheets(), simulation.sheets[s], constraints.pins[s]);
  for (std::size_t c = 0; c < constraints.paths.size(); ++c)
    set(to.add_paths(), constraints.paths[c], constraints.leads[c]);
  for (const Grip& grip : constraints.grips) {
    stored::KeptGrab* kept = to.add_grabs();
    kept->set_sheet(static_cast<int>(grip.sheet));
    kept->set_particle(grip.particle);
    kept->set_hand(grip.hand);
    kept->set_pinned(grip.pinned);
  }
  if (simulation.relaxation) set(to.mutable_relaxation(), *simulation.relaxation);
  for (const LogEntry& entry : snapshot.under_way)
    to.add_under_way()->ParseFromString(encode(entry));
  *to.add_plans() = to_proto(simulation.plan);
  Plans plans(to);
  for (const auto& answer : snapshot.answers) set(to.add_answers(), answer, plans);
  return to.SerializeAsString();
}

SessionSnapshot decode_snapshot(const std::string& uid, const std::string& bytes) {
  stored::KeptSnapshot from;
  if (!from.ParseFromString(bytes) || from.plans().empty()) throw StoreError("no snapshot");
  if (from.uid() != uid) throw StoreError("the snapshot of another session");
  SessionSnapshot snapshot;
  snapshot.numerics_id = from.numerics_id();
  snapshot.entries = from.entries();
  snapshot.create_time = time_of(from.create_time());
  std::vector<std::shared_ptr<const Plan>> plans;
  for (const auto& plan : from.plans())
    plans.push_back(std::make_shared<const Plan>(plan_of(plan)));
  for (const auto& each : from.answers())
    snapshot.answers.push_back(
        {{each.request_id(), each.request_checksum()}, outcome_of(each, plans)});
  for (const auto& each : from.under_way())
    snapshot.under_way.push_back(decode_entry(each.SerializeAsString()));

  Snapshot& simulation = snapshot.simulation;
  simulation.frame = from.frame();
  simulation.substeps = from.substeps();
  simulation.frames_at_rest = from.frames_at_rest();
  simulation.halvings = from.halvings();
  simulation.plan = *plans.front();
  for (const auto& each : from.repairs())
    simulation.repairs.push_back({each.frame(), each.substep_s(), each.reason(), each.lasts()});
  for (const auto& each : from.sheets()) {
    simulation.sheets.push_back({textile_of(each.textile()), each.most_strain(),
                                 columns_of(each.positions_m()),
                                 columns_of(each.velocities_m_per_s()), each.solver()});
    if (each.has_ramp()) {
      const stored::KeptRamp& ramp = each.ramp();
      simulation.sheets.back().ramp = {textile_of(ramp.from()), textile_of(ramp.to()), ramp.begin(),
                                       ramp.end()};
    }
    if (each.has_budget()) simulation.sheets.back().budget = budget_of(each.budget());
    auto& pins = simulation.constraints.pins.emplace_back();
    for (const auto& pin : each.pins()) pins.push_back(to_pin(pin));
  }
  for (const auto& each : from.paths()) {
    simulation.constraints.paths.push_back(to_path(each.path()));
    auto& lead = simulation.constraints.leads.emplace_back();
    if (const auto& kept = each.lead(); each.has_lead())
      lead = {kept.begin_s(), kept.end_s(), kept.from_s(), kept.to_s()};
  }
  for (const auto& each : from.grabs()) {
    simulation.constraints.grips.push_back(
        {static_cast<std::size_t>(each.sheet()), each.particle(), each.hand(), each.pinned()});
  }
  if (from.has_relaxation()) simulation.relaxation = relaxation_of(from.relaxation());
  return snapshot;
}

}  // namespace weft::records

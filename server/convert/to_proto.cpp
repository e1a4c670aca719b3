#include <google/protobuf/util/time_util.h>

#include "core/lattice/shown.h"
#include "server/convert/convert.h"
#include "server/convert/names.h"

namespace weft {
namespace {

using google::protobuf::RepeatedPtrField;

void set(v1::Vector3* to, const Vector3d& from) {
  to->set_x(from.x());
  to->set_y(from.y());
  to->set_z(from.z());
}

void set(v1::Rotation* to, const Quaterniond& from) {
  to->set_w(from.w());
  to->set_x(from.x());
  to->set_y(from.y());
  to->set_z(from.z());
}

v1::Evaluator to_proto(Evaluator evaluator) {
  switch (evaluator) {
    case Evaluator::kSeries:
      return v1::EVALUATOR_SERIES;
    case Evaluator::kExact:
      return v1::EVALUATOR_EXACT;
    case Evaluator::kLinearized:
      return v1::EVALUATOR_LINEARIZED;
    case Evaluator::kPolynomial:
      return v1::EVALUATOR_POLYNOMIAL;
  }
  return v1::EVALUATOR_UNSPECIFIED;
}

v1::Integrator to_proto(IntegratorKind integrator) {
  switch (integrator) {
    case IntegratorKind::kVerlet:
      return v1::INTEGRATOR_VERLET;
    case IntegratorKind::kEuler:
      return v1::INTEGRATOR_EULER;
    case IntegratorKind::kMidpoint:
      return v1::INTEGRATOR_MIDPOINT;
    case IntegratorKind::kRk4:
      return v1::INTEGRATOR_RK4;
    case IntegratorKind::kLaggedVerlet:
      return v1::INTEGRATOR_VERLET_LAGGED;
  }
  return v1::INTEGRATOR_UNSPECIFIED;
}

void set(v1::BendingLaw* to, const ChoiKo& from) {
  v1::ChoiKo* law = to->mutable_choi_ko();
  law->set_evaluator(to_proto(from.evaluator));
  law->set_segments(from.segments);
  law->set_degree(from.degree);
  law->set_fold_clamp(from.fold_clamp);
  law->set_diagonal_bend(from.diagonal_bend);
  law->set_optimal_breakpoints(from.optimal_breakpoints);
}

void set(v1::BendingLaw* to, const Isometric& from) {
  to->mutable_isometric()->set_resist_compression(from.resist_compression);
}

void set(v1::Textile* to, const MeasuredTextile& from) {
  v1::MeasuredTextile* measured = to->mutable_measured();
  measured->set_areal_density_kg_per_m2(from.areal_density);
  measured->set_tensile_warp_n_per_m(from.tensile_warp);
  measured->set_tensile_weft_n_per_m(from.tensile_weft);
  measured->set_shear_n_per_m(from.shear);
  measured->set_bend_rigidity_warp_n_m(from.bend_rigidity_warp);
  measured->set_bend_rigidity_weft_n_m(from.bend_rigidity_weft);
  measured->set_air_drag_kg_per_m2_s(from.air_drag);
}

void set(v1::Textile* to, const RawTextile& from) {
  v1::RawTextile* raw = to->mutable_raw();
  raw->set_particle_mass_kg(from.particle_mass);
  raw->set_stretch_n_per_m(from.stretch);
  raw->set_shear_n_per_m(from.shear);
  raw->set_bend_n_m2(from.bend);
  raw->set_clamp_n_per_m(from.clamp.value_or(from.stretch));
  raw->set_air_drag_kg_per_s(from.air_drag);
}

void set(v1::Sheet* to, const Grid& simulated) {
  const Grid grid = std::get<Grid>(shown(simulated));
  to->mutable_grid()->set_rows(grid.rows);
  to->mutable_grid()->set_columns(grid.columns);
  to->mutable_grid()->set_spacing_m(grid.spacing);
  to->mutable_grid()->set_simulated_every(simulated.simulated_every);
}

// Those of particles that are simulated.
void show(const SheetShape& shape, google::protobuf::RepeatedField<std::int32_t>& particles) {
  for (std::int32_t& particle : particles) particle = shown_particle(shape, particle);
}

// values: of each particle that is simulated x, y, z.
void add(google::protobuf::RepeatedField<double>* to, const std::vector<double>& values,
         const SheetShape& shape) {
  if (!is_interpolated(shape) || values.empty()) return to->Add(values.begin(), values.end());
  const Eigen::Map<const Matrix3Xd> simulated(values.data(), 3, particle_count(shape));
  const Matrix3Xd all = resample(simulated, std::get<Grid>(shape), std::get<Grid>(shown(shape)));
  to->Add(all.data(), all.data() + all.size());
}

void set(v1::Sheet* to, const SheetDefinition& from, const Textile& textile,
         StartValues start_values) {
  to->set_name(from.name);
  if (const auto* grid = std::get_if<Grid>(&from.shape))
    set(to, *grid);
  else
    to->mutable_triangles()->set_asset(from.asset);
  *to->mutable_textile() = to_proto(textile);
  std::visit([&](const auto& law) { set(to->mutable_bending(), law); }, from.bending);
  set(to->mutable_placement()->mutable_origin_m(), from.origin);
  set(to->mutable_placement()->mutable_rotation(), from.rotation);
  if (start_values == StartValues::kIncluded) {
    add(to->mutable_start_positions_m(), from.start_positions, from.shape);
    add(to->mutable_start_velocities_m_per_s(), from.start_velocities, from.shape);
  }
  for (const auto& pin : from.pins) {
    v1::Pin* added = to->add_pins();
    *added = to_proto(pin);
    show(from.shape, *added->mutable_particles());
  }
  to->set_skin_m(from.skin_or_default());
  to->set_thickness_m(from.thickness_or_default());
  if (from.tether_stretch) to->set_tether_stretch(*from.tether_stretch);
}

void set(v1::Collider* to, const Plane& plane) {
  set(to->mutable_plane()->mutable_point_m(), plane.point);
  set(to->mutable_plane()->mutable_normal(), plane.normal);
}

void set(v1::Collider* to, const Sphere& sphere) {
  set(to->mutable_sphere()->mutable_center_m(), sphere.center);
  to->mutable_sphere()->set_radius_m(sphere.radius);
}

void set(v1::Collider* to, const Box& box) {
  set(to->mutable_box()->mutable_center_m(), box.center);
  set(to->mutable_box()->mutable_half_size_m(), box.half_size);
  set(to->mutable_box()->mutable_rotation(), box.rotation);
}

void set(v1::Collider* to, const Capsule& capsule) {
  set(to->mutable_capsule()->mutable_start_m(), capsule.start);
  set(to->mutable_capsule()->mutable_end_m(), capsule.end);
  to->mutable_capsule()->set_radius_m(capsule.radius);
}

// The rest is the collider's.
void set(v1::Collider* to, const SharedBody& /*body*/) { to->mutable_mesh(); }

void set(v1::Dressing* to, const Dressing& from, const std::vector<SheetDefinition>& sheets) {
  to->set_close_s(from.close);
  to->set_settle_s(from.settle);
  to->set_drag_per_s(from.drag);
  to->set_deflate_m(from.deflate);
  for (const Hold& hold : from.holds) {
    v1::Hold* added = to->add_holds();
    const SheetDefinition& sheet = sheets[static_cast<std::size_t>(hold.sheet)];
    added->set_sheet(sheet.name);
    added->mutable_particles()->Add(hold.particles.begin(), hold.particles.end());
    show(sheet.shape, *added->mutable_particles());
    added->set_until_s(hold.until);
  }
}

void set(v1::Environment* to, const Environment& from) {
  set(to->mutable_gravity_m_per_s2(), from.gravity);
  if (!from.wind) return;
  v1::Wind* wind = to->mutable_wind();
  set(wind->mutable_velocity_m_per_s(), from.wind->velocity);
  wind->set_gust(from.wind->gust);
  wind->set_gust_period_s(from.wind->gust_period);
  wind->set_air_density_kg_per_m3(from.wind->air_density);
  wind->set_tangential_drag_kg_per_m2_s(from.wind->tangential_drag);
}

void set(v1::SolverSettings* to, const SolverSettings& from) {
  to->set_integrator(to_proto(from.integrator));
  to->set_frame_step_s(from.frame_step);
  if (from.substep) to->set_substep_s(*from.substep);
  to->set_allow_unstable(from.allow_unstable);
  to->set_safety(from.safety);
  to->set_max_repairs(from.max_repairs);
  if (from.max_self_weight_strain) to->set_max_self_weight_strain(*from.max_self_weight_strain);
  to->set_step_bound(from.step_bound == StepBound::kUnsheared ? v1::STEP_BOUND_UNSHEARED
                                                              : v1::STEP_BOUND_EVERY_SHAPE);
  to->set_slow_forces_every(from.slow_forces_every);
  to->set_precision(from.precision == Precision::kSingle ? v1::PRECISION_SINGLE
                                                         : v1::PRECISION_DOUBLE);
}

void set(v1::Scene* to, const Scene& from, const std::vector<Textile>& textiles,
         StartValues start_values) {
  for (std::size_t i = 0; i < from.sheets.size(); ++i) {
    set(to->add_sheets(), from.sheets[i], textiles[i], start_values);
  }
  for (const auto& collider : from.colliders) {
    v1::Collider* added = to->add_colliders();
    added->set_name(collider.name);
    std::visit([&](const auto& shape) { set(added, shape); }, collider.shape);
    if (added->has_mesh()) added->mutable_mesh()->set_asset(collider.asset);
    if (collider.cell) added->mutable_mesh()->set_cell_m(*collider.cell);
    added->set_friction_coefficient(collider.friction);
    *added->mutable_path() = to_proto(collider.path);
  }
  to->set_cloth_contact(from.cloth_contact);
  if (from.untangle) to->set_untangle_s(*from.untangle);
  if (from.dressing) set(to->mutable_dressing(), *from.dressing, from.sheets);
  set(to->mutable_environment(), from.environment);
  set(to->mutable_solver(), from.solver);
}

}  // namespace

google::protobuf::Timestamp timestamp_of(std::chrono::system_clock::time_point time) {
  return google::protobuf::util::TimeUtil::NanosecondsToTimestamp(
      std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count());
}

std::set<std::string> assets_of(const Scene& scene) {
  std::set<std::string> hashes;
  for (const auto& sheet : scene.sheets)
    if (!sheet.asset.empty()) hashes.insert(hash_of(sheet.asset));
  for (const auto& collider : scene.colliders)
    if (!collider.asset.empty()) hashes.insert(hash_of(collider.asset));
  return hashes;
}

namespace {

v1::Session session_of(const SessionIdentity& identity) {
  v1::Session result;
  result.set_name(session_name(identity.id));
  result.set_uid(identity.uid);
  result.set_numerics_id(identity.numerics_id);
  result.set_owner(identity.owner);
  *result.mutable_create_time() = timestamp_of(identity.create_time);
  return result;
}

}  // namespace

v1::Session to_proto(const SessionIdentity& identity, v1::Scene given) {
  v1::Session result = session_of(identity);
  for (v1::Sheet& sheet : *given.mutable_sheets()) {
    sheet.clear_start_positions_m();
    sheet.clear_start_velocities_m_per_s();
    v1::Textile& textile = *sheet.mutable_textile();
    if (textile.has_raw() && !textile.raw().has_clamp_n_per_m())
      textile.mutable_raw()->set_clamp_n_per_m(textile.raw().stretch_n_per_m());
  }
  *result.mutable_scene() = std::move(given);
  return result;
}

v1::Session to_proto(const Session& session, StartValues start_values) {
  const SessionStatus status = session.status();
  v1::Session result = session_of(session.identity());
  set(result.mutable_scene(), session.scene(), status.textiles, start_values);
  result.set_state(to_proto(status.state));
  result.set_frame(status.newest->number);
  result.set_time_s(status.newest->time);
  result.set_at_rest(status.newest->at_rest);
  if (status.newest->residual) result.set_residual(*status.newest->residual);
  *result.mutable_plan() = to_proto(*status.plan);
  result.set_failure(status.failure);
  result.set_lateness_s(status.lateness.count());
  for (const auto& repair : status.repairs) *result.add_repairs() = to_proto(repair);
  return result;
}

v1::Verdict to_proto(const Judgement& judgement, std::int64_t frame) {
  const Verdict& from = judgement.verdict;
  v1::Verdict to;
  to.set_frame(frame);
  to.set_good(from.faults.empty());
  for (const Fault& fault : from.faults) {
    v1::Fault* added = to.add_faults();
    added->set_code(fault.code);
    added->set_message(fault.message);
  }
  to.set_dressed(from.dressed);
  to.set_at_rest(from.at_rest);
  to.set_cloth_cut_count(from.cloth_cuts);
  to.set_particles_inside(from.particles_inside);
  to.set_deepest_m(from.deepest);
  to.set_strain_warp(from.strain_warp);
  to.set_strain_weft(from.strain_weft);
  to.set_largest_pressure_pa(from.largest_pressure);
  to.set_slid_m(from.slid);
  to.set_substep_count(judgement.substeps);
  to.set_computing_s(judgement.seconds);
  return to;
}

v1::Snapshot to_proto(const Session& session, const NamedSnapshot& snapshot) {
  v1::Snapshot result;
  result.set_name(snapshot_name(session.id(), snapshot.id));
  result.set_frame(snapshot.frame);
  result.set_time_s(static_cast<double>(snapshot.frame) * session.scene().solver.frame_step);
  *result.mutable_create_time() = timestamp_of(snapshot.create_time);
  result.set_size_bytes(snapshot.bytes);
  result.set_numerics_id(snapshot.numerics_id);
  result.set_damage(snapshot.damage);
  return result;
}

v1::Textile to_proto(const Textile& textile) {
  v1::Textile result;
  std::visit([&](const auto& model) { set(&result, model); }, textile.model);
  if (textile.damping) result.set_damping_kg_per_s(*textile.damping);
  if (textile.damping_ratio) result.set_damping_ratio(*textile.damping_ratio);
  result.set_friction_coefficient(textile.friction);
  return result;
}

v1::Textile as_given(const Textile& textile) {
  v1::Textile given = to_proto(textile);
  if (const auto* raw = std::get_if<RawTextile>(&textile.model); raw && !raw->clamp) {
    given.mutable_raw()->clear_clamp_n_per_m();
  }
  return given;
}

v1::Scene as_given(const Scene& scene) {
  const std::vector<Textile> textiles = textiles_of(scene);
  v1::Scene given;
  set(&given, scene, textiles, StartValues::kIncluded);
  for (int i = 0; i < given.sheets_size(); ++i) {
    *given.mutable_sheets(i)->mutable_textile() = as_given(textiles[static_cast<std::size_t>(i)]);
  }
  return given;
}

v1::Plan to_proto(const Plan& plan) {
  v1::Plan result;
  result.set_substeps_per_frame(plan.step.substeps);
  result.set_substep_s(plan.step.substep);
  result.set_linear_bound_s(plan.step.linear_bound);
  result.set_estimated_bound_s(plan.step.estimated_bound);
  result.set_damping_ratio(plan.step.damping_ratio);
  result.set_limiting_sheet(plan.step.limiting_sheet);
  result.set_unsheared_bound_s(plan.step.unsheared_bound);
  result.set_slow_forces_every(plan.step.slow_every);
  for (const auto& pass : plan.passes) result.add_passes(pass);
  for (const auto& skipped : plan.skipped) {
    v1::SkippedPass* added = result.add_skipped();
    added->set_pass(skipped.pass);
    added->set_reason(skipped.reason);
  }
  for (const auto& warning : plan.warnings) {
    v1::Warning* added = result.add_warnings();
    added->set_code(warning.code);
    added->set_field(warning.field);
    added->set_message(warning.message);
  }
  for (const auto& limit : plan.bending_limits) {
    v1::BendingLimit* added = result.add_bending_limits();
    added->set_sheet(limit.sheet);
    added->set_least_curvature_per_m(limit.least_curvature);
    added->set_finest_spacing_m(limit.finest_spacing);
  }
  result.set_particle_substeps_per_second(plan.particle_substeps);
  for (const auto& cost : plan.stretch_costs) {
    v1::StretchCost* added = result.add_stretch_costs();
    added->set_sheet(cost.sheet);
    added->set_self_weight_strain(cost.self_weight_strain);
  }
  for (const auto& damping : plan.dampings) {
    v1::SheetDamping* added = result.add_dampings();
    added->set_sheet(damping.sheet);
    added->set_damping_kg_per_s(damping.damping);
    added->set_damping_ratio(damping.ratio);
  }
  return result;
}

v1::Repair to_proto(const Repair& repair) {
  v1::Repair result;
  result.set_frame(repair.frame);
  result.set_substep_s(repair.substep);
  result.set_reason(repair.reason);
  result.set_lasts(repair.lasts);
  return result;
}

RepeatedPtrField<v1::Keyframe> to_proto(const Path& path) {
  RepeatedPtrField<v1::Keyframe> keyframes;
  for (const auto& key : path) {
    v1::Keyframe* added = keyframes.Add();
    added->set_time_s(key.time);
    set(added->mutable_offset_m(), key.offset);
  }
  return keyframes;
}

v1::Pin to_proto(const Pin& pin) {
  v1::Pin result;
  result.mutable_particles()->Add(pin.particles.begin(), pin.particles.end());
  *result.mutable_path() = to_proto(pin.path);
  return result;
}

v1::LabReport to_proto(const LabOrder& order, const LabReport& report) {
  v1::LabReport result;
  result.set_method(report.method);
  *result.mutable_textile() = to_proto(Textile{order.textile}).measured();
  for (const LabValue& value : report.values) {
    v1::LabValue* added = result.add_values();
    added->set_quantity(value.quantity);
    added->set_unit(value.unit);
    added->set_spacing_m(value.spacing);
    added->set_particles(value.particles);
    if (value.asked) added->set_asked(*value.asked);
    added->set_found(value.found);
  }
  for (const LabCurve& curve : report.curves) {
    v1::LabCurve* added = result.add_curves();
    added->set_name(curve.name);
    for (const auto& column : curve.columns) added->add_columns(column);
    for (const auto& row : curve.rows) added->mutable_values()->Add(row.begin(), row.end());
  }
  for (const auto& note : report.notes) result.add_notes(note);
  return result;
}

v1::SessionState to_proto(SessionState state) {
  switch (state) {
    case SessionState::kRestoring:
      return v1::SESSION_STATE_RESTORING;
    case SessionState::kPaused:
      return v1::SESSION_STATE_PAUSED;
    case SessionState::kRunning:
      return v1::SESSION_STATE_RUNNING;
    case SessionState::kFailed:
      return v1::SESSION_STATE_FAILED;
  }
  return v1::SESSION_STATE_UNSPECIFIED;
}

v1::Action to_proto(const Action& action) {
  v1::Action to;
  const auto of_particle = [&](auto* part) {
    part->set_sheet(action.name);
    part->set_particle(action.particle);
  };
  const auto lead = [&](v1::Vector3* target, auto* part) {
    set(target, action.target);
    if (action.duration) part->set_duration_s(*action.duration);
  };
  switch (action.kind) {
    case Action::Kind::kGrab:
      of_particle(to.mutable_grab());
      break;
    case Action::Kind::kDrag:
      of_particle(to.mutable_drag());
      lead(to.mutable_drag()->mutable_target_m(), to.mutable_drag());
      break;
    case Action::Kind::kRelease:
      of_particle(to.mutable_release());
      break;
    case Action::Kind::kPin:
      of_particle(to.mutable_pin());
      break;
    case Action::Kind::kUnpin:
      of_particle(to.mutable_unpin());
      break;
    case Action::Kind::kMoveCollider:
      to.mutable_move_collider()->set_collider(action.name);
      lead(to.mutable_move_collider()->mutable_offset_m(), to.mutable_move_collider());
      break;
    case Action::Kind::kPoseCollider:
      to.mutable_pose_collider()->set_collider(action.name);
      to.mutable_pose_collider()->set_pose_time_s(action.pose_time);
      to.mutable_pose_collider()->set_speed_m_per_s(action.pose_speed);
      break;
    case Action::Kind::kRelax:
      to.mutable_relax();
      break;
    case Action::Kind::kLetGo:
      break;
  }
  return to;
}

}  // namespace weft

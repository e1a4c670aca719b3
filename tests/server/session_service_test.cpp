#include <thread>

#include "tests/support/service/service.h"

namespace weft::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Sessions = Service::Sessions;

v1::UpdateTextileRequest update(const v1::Session& session, std::vector<std::string> mask = {}) {
  v1::UpdateTextileRequest request;
  request.set_name(session.name());
  for (auto& path : mask) request.mutable_update_mask()->add_paths(std::move(path));
  return request;
}

std::vector<std::string> names(const v1::ListSessionsResponse& response) {
  std::vector<std::string> result;
  for (const auto& session : response.sessions()) result.push_back(session.name());
  return result;
}

TEST(Sessions, ShowTheirSceneWithEveryDefaultFilledIn) {
  Service service;
  const v1::Session session = service.create(small_scene(), "curtain");
  EXPECT_EQ(session.name(), "sessions/curtain");
  EXPECT_EQ(session.state(), v1::SESSION_STATE_PAUSED);
  EXPECT_GT(session.create_time().seconds(), 0);
  EXPECT_GT(session.plan().substeps_per_frame(), 0);
  const v1::Sheet& sheet = session.scene().sheets(0);
  EXPECT_EQ(sheet.name(), "sheet");
  EXPECT_EQ(sheet.textile().damping_case(), v1::Textile::DAMPING_NOT_SET);  // by the plan
  EXPECT_GE(session.plan().dampings(0).damping_kg_per_s(), 2e-4);
  EXPECT_EQ(sheet.textile().raw().clamp_n_per_m(), 200);
  EXPECT_EQ(sheet.bending().choi_ko().segments(), 32);
  EXPECT_TRUE(sheet.bending().choi_ko().diagonal_bend());
  EXPECT_EQ(sheet.skin_m(), 0.05 / 10);
  EXPECT_EQ(session.scene().environment().gravity_m_per_s2().y(), -9.80665);
  EXPECT_EQ(session.scene().solver().integrator(), v1::INTEGRATOR_VERLET);
  EXPECT_EQ(session.scene().solver().frame_step_s(), 1.0 / 60);
}

TEST(Sessions, MadeFromWhatASessionShowsGiveEqualFrames) {
  Service service;
  const v1::Session original = service.create();
  const v1::Session copy = service.create(original.scene());
  service.step(original, 10);
  service.step(copy, 10);
  Stream one(service, frames_of(original, 10, 10)), two(service, frames_of(copy, 10, 10));
  EXPECT_EQ(one.frame().SerializeAsString(), two.frame().SerializeAsString());
}

TEST(Sessions, AreListedInOrderOfNamePageByPageWithoutStartPositions) {
  Service service;
  v1::Scene scene = small_scene();
  for (int i = 0; i < 60; ++i) scene.mutable_sheets(0)->add_start_velocities_m_per_s(0);
  for (const char* id : {"b", "c", "a"}) service.create(scene, id);
  v1::ListSessionsRequest request;
  request.set_page_size(2);
  v1::ListSessionsResponse first, second;
  ASSERT_TRUE(service.call(&Sessions::ListSessions, request, &first).ok());
  EXPECT_THAT(names(first), ElementsAre("sessions/a", "sessions/b"));
  EXPECT_EQ(first.sessions(0).scene().sheets(0).start_velocities_m_per_s_size(), 0);
  request.set_page_token(first.next_page_token());
  ASSERT_TRUE(service.call(&Sessions::ListSessions, request, &second).ok());
  EXPECT_THAT(names(second), ElementsAre("sessions/c"));
  EXPECT_THAT(second.next_page_token(), IsEmpty());
}

TEST(Sessions, AreGoneOnceDeletedAndTheirNameIsFreeForAnother) {
  Service service;
  const v1::Session session = service.create(small_scene(), "curtain");
  service.erase(session);
  v1::DeleteSessionRequest request;
  request.set_name(session.name());
  EXPECT_EQ(service.error(&Sessions::DeleteSession, request).code, grpc::StatusCode::NOT_FOUND);
  request.set_allow_missing(true);
  EXPECT_EQ(service.error(&Sessions::DeleteSession, request).code, grpc::StatusCode::OK);
  EXPECT_NE(service.create(small_scene(), "curtain").uid(), session.uid());
}

TEST(Sessions, ThatAreOnlyValidatedAreNotCreated) {
  Service service;
  v1::CreateSessionRequest request;
  *request.mutable_session()->mutable_scene() = small_scene();
  request.set_validate_only(true);
  v1::Session session;
  ASSERT_TRUE(service.call(&Sessions::CreateSession, request, &session).ok());
  EXPECT_GT(session.plan().linear_bound_s(), 0);
  EXPECT_THAT(session.plan().passes(), ::testing::Not(IsEmpty()));
  EXPECT_EQ(service.info().sessions(), 0);
}

TEST(Sessions, StepAndSayWhichFramesTheyComputed) {
  Service service;
  const v1::Session session = service.create();
  const auto step = service.step(session, 6);
  EXPECT_EQ(step.applied_frame(), 1);
  EXPECT_EQ(step.frame(), 6);
  EXPECT_DOUBLE_EQ(step.time_s(), 6.0 / 60);
  EXPECT_EQ(service.get(session).frame(), 6);
}

TEST(Sessions, RunUntilAFrameAtTheirPaceAndPauseThere) {
  Service service;
  const v1::Session session = service.create();
  Stream stream(service, frames_of(session, 0, 12));
  const auto begin = std::chrono::steady_clock::now();
  v1::RunSessionRequest request;
  request.set_name(session.name());
  request.set_time_scale(2);
  request.set_until_frame(12);
  v1::RunSessionResponse response;
  ASSERT_TRUE(service.call(&Sessions::RunSession, request, &response).ok());
  EXPECT_EQ(response.applied_frame(), 1);
  EXPECT_THAT(stream.rest(), SizeIs(13));
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(100));
  EXPECT_EQ(service.get(session).state(), v1::SESSION_STATE_PAUSED);
}

void run_until_rest(Service& service, const v1::Session& session) {
  v1::RunSessionRequest request;
  request.set_name(session.name());
  request.set_until_rest(true);
  ASSERT_EQ(service.error(&Sessions::RunSession, request).code, grpc::StatusCode::OK);
}

TEST(Sessions, RunUntilRest) {
  Service service;
  const v1::Session session = service.create();
  auto frames = frames_of(session);
  frames.mutable_format()->set_stats(true);
  Stream stream(service, frames);
  run_until_rest(service, session);
  while (!stream.frame().stats().at_rest()) {
  }
  const v1::Session rested = service.get(session);
  EXPECT_TRUE(rested.at_rest());
  EXPECT_EQ(rested.state(), v1::SESSION_STATE_PAUSED);
}

TEST(Sessions, RelaxToRestAndSayWhatForcesAreLeft) {
  Service service;
  const v1::Session session = service.create();
  auto frames = frames_of(session);
  frames.mutable_format()->set_stats(true);
  Stream stream(service, frames);
  EXPECT_FALSE(stream.frame().stats().has_residual());
  v1::ApplyActionsRequest relax;
  relax.set_name(session.name());
  relax.add_actions()->mutable_relax();
  ASSERT_EQ(service.error(&Sessions::ApplyActions, relax).code, grpc::StatusCode::OK);
  EXPECT_FALSE(service.get(session).has_residual());
  run_until_rest(service, session);
  v1::FrameStats stats;
  while (!stats.at_rest()) {
    stats = stream.frame().stats();
    EXPECT_TRUE(stats.has_residual());
  }
  EXPECT_EQ(stats.kinetic_energy_j(), 0);
  const v1::Session rested = service.get(session);
  EXPECT_TRUE(rested.at_rest());
  EXPECT_EQ(rested.residual(), stats.residual());
}

TEST(Sessions, PauseAfterTheFrameTheyCompute) {
  Service service;
  const v1::Session session = service.create();
  Stream stream(service, frames_of(session));
  service.run(session, 1'000'000'000);
  while (stream.frame().number() < 5) {
  }
  const auto paused = service.pause(session);
  EXPECT_EQ(service.get(session).frame(), paused.applied_frame() - 1);
  EXPECT_EQ(service.get(session).state(), v1::SESSION_STATE_PAUSED);
}

TEST(Sessions, AStepEndsWhenItsCallerGoesAway) {
  Service service;
  const v1::Session session = service.create();
  Stream stream(service, frames_of(session));
  grpc::ClientContext context;
  std::jthread caller([&] {
    v1::StepSessionRequest request;
    request.set_name(session.name());
    request.set_frames(100'000);
    v1::StepSessionResponse response;
    EXPECT_EQ(service.sessions->StepSession(&context, request, &response).error_code(),
              grpc::StatusCode::CANCELLED);
  });
  while (stream.frame().number() < 5) {
  }
  context.TryCancel();
  EXPECT_LT(service.step(session, 1).frame(), 100'000);
}

TEST(Accuracy, SetsWhatASceneLeavesOpenAndNothingElse) {
  Service service;
  v1::Scene scene = small_scene();
  scene.mutable_sheets(0)->clear_bending();
  const auto created = [&](v1::Accuracy accuracy) {
    scene.mutable_solver()->set_accuracy(accuracy);
    return service.create(scene);
  };
  const v1::Session standard = created(v1::ACCURACY_UNSPECIFIED);
  EXPECT_EQ(created(v1::ACCURACY_STANDARD).scene().SerializeAsString(),
            standard.scene().SerializeAsString());

  const v1::Session draft = created(v1::ACCURACY_DRAFT);
  EXPECT_EQ(draft.scene().solver().max_self_weight_strain(), 0.01);
  EXPECT_EQ(draft.scene().solver().safety(), 0.9);
  EXPECT_EQ(draft.scene().solver().step_bound(), v1::STEP_BOUND_UNSHEARED);
  EXPECT_EQ(standard.scene().solver().step_bound(), v1::STEP_BOUND_EVERY_SHAPE);
  EXPECT_EQ(draft.scene().solver().integrator(), v1::INTEGRATOR_VERLET_LAGGED);
  EXPECT_EQ(standard.scene().solver().integrator(), v1::INTEGRATOR_VERLET);
  EXPECT_EQ(draft.scene().solver().slow_forces_every(), 4);
  EXPECT_EQ(standard.scene().solver().slow_forces_every(), 4);

  const v1::Session fine = created(v1::ACCURACY_FINE);
  EXPECT_EQ(fine.scene().solver().precision(), v1::PRECISION_DOUBLE);
  EXPECT_EQ(fine.scene().solver().slow_forces_every(), 1);
  EXPECT_EQ(fine.scene().sheets(0).bending().choi_ko().evaluator(), v1::EVALUATOR_POLYNOMIAL);
  EXPECT_LT(fine.plan().substep_s(), 0.26 * standard.plan().linear_bound_s());

  scene.mutable_solver()->set_safety(0.5);
  scene.mutable_solver()->set_precision(v1::PRECISION_SINGLE);
  scene.mutable_sheets(0)->mutable_bending()->mutable_isometric();
  const v1::Session given = created(v1::ACCURACY_FINE);
  EXPECT_EQ(given.scene().solver().safety(), 0.5);
  EXPECT_EQ(given.scene().solver().precision(), v1::PRECISION_SINGLE);
  EXPECT_TRUE(given.scene().sheets(0).bending().has_isometric());

  scene.mutable_dressing();
  EXPECT_EQ(created(v1::ACCURACY_STANDARD).scene().solver().step_bound(), v1::STEP_BOUND_UNSHEARED);
  EXPECT_EQ(created(v1::ACCURACY_FINE).scene().solver().step_bound(), v1::STEP_BOUND_EVERY_SHAPE);
  scene.mutable_solver()->set_step_bound(v1::STEP_BOUND_EVERY_SHAPE);
  EXPECT_EQ(created(v1::ACCURACY_STANDARD).scene().solver().step_bound(),
            v1::STEP_BOUND_EVERY_SHAPE);
}

TEST(UpdateTextile, ChangesAWholeTextileFromTheNextFrameOn) {
  Service service;
  const v1::Session session = service.create();
  service.step(session, 3);
  auto request = update(session);
  request.mutable_textile()->set_preset("denim_11oz");
  v1::UpdateTextileResponse response;
  ASSERT_TRUE(service.call(&Sessions::UpdateTextile, request, &response).ok());
  EXPECT_EQ(response.applied_frame(), 4);
  EXPECT_GT(response.textile().measured().areal_density_kg_per_m2(), 0) << "presets are numbers";
  EXPECT_NE(response.plan().substep_s(), session.plan().substep_s());
  EXPECT_EQ(service.get(session).scene().sheets(0).textile().SerializeAsString(),
            response.textile().SerializeAsString());
}

TEST(UpdateTextile, ByMaskChangesTheNamedFieldsOnly) {
  Service service;
  const v1::Session session = service.create();
  auto request = update(session, {"raw.stretch_n_per_m", "friction_coefficient"});
  request.mutable_textile()->mutable_raw()->set_stretch_n_per_m(150);
  request.mutable_textile()->mutable_raw()->set_bend_n_m2(9);
  v1::UpdateTextileResponse response;
  ASSERT_TRUE(service.call(&Sessions::UpdateTextile, request, &response).ok());
  EXPECT_EQ(response.textile().raw().stretch_n_per_m(), 150);
  EXPECT_EQ(response.textile().raw().clamp_n_per_m(), 150) << "absent, it follows the stretch";
  EXPECT_EQ(response.textile().raw().bend_n_m2(), 1e-5) << "not in the mask";
  EXPECT_EQ(response.textile().friction_coefficient(), 0.3) << "absent, it has its default";
}

TEST(UpdateTextile, WithBadValuesChangesNothing) {
  Service service;
  const v1::Session session = service.create();
  const auto fields_of = [&](const v1::UpdateTextileRequest& request) {
    const Error error = service.error(&Sessions::UpdateTextile, request);
    EXPECT_EQ(error.code, grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_EQ(error.reason(), "FIELD_INVALID");
    return error.fields();
  };
  auto no_textile = update(session);
  EXPECT_THAT(fields_of(no_textile), ElementsAre("textile"));
  auto no_model = update(session);
  no_model.mutable_textile();
  EXPECT_THAT(fields_of(no_model), ElementsAre("textile.model"));
  auto nan = update(session, {"raw.bend_n_m2"});
  nan.mutable_textile()->mutable_raw()->set_bend_n_m2(std::nan(""));
  EXPECT_THAT(fields_of(nan), ElementsAre("textile.raw.bend_n_m2"));
  auto unknown = update(session, {"raw.bend", "raw.bend_n_m2"});
  unknown.mutable_textile()->mutable_raw();
  EXPECT_THAT(fields_of(unknown), ElementsAre("update_mask.paths[0]"));
  auto other_model = update(session, {"measured.shear_n_per_m"});
  other_model.mutable_textile()->mutable_measured()->set_shear_n_per_m(5);
  EXPECT_THAT(fields_of(other_model), ElementsAre("update_mask.paths[0]"));
  auto absent = update(session, {"raw.bend_n_m2"});
  absent.mutable_textile()->set_friction_coefficient(1);
  EXPECT_THAT(fields_of(absent), ElementsAre("textile.raw"));
  auto no_preset = update(session);
  no_preset.mutable_textile()->set_preset("kevlar");
  EXPECT_THAT(fields_of(no_preset), ElementsAre("textile.preset"));
  auto no_sheet = update(session);
  no_sheet.set_sheet("other");
  EXPECT_THAT(fields_of(no_sheet), ElementsAre("sheet"));
  EXPECT_EQ(service.get(session).scene().SerializeAsString(), session.scene().SerializeAsString());
}

TEST(UpdateTextile, OverTimeAnswersWithItsEndAndShowsWhereItHasCome) {
  Service service;
  const v1::Session session = service.create();
  auto request = update(session, {"raw.stretch_n_per_m"});
  const double given = session.scene().sheets(0).textile().raw().stretch_n_per_m();
  request.mutable_textile()->mutable_raw()->set_stretch_n_per_m(2 * given);
  request.set_duration_s(0.1);
  v1::UpdateTextileResponse response;
  ASSERT_TRUE(service.call(&Sessions::UpdateTextile, request, &response).ok());
  EXPECT_EQ(response.applied_frame(), 1);
  EXPECT_EQ(response.textile().raw().stretch_n_per_m(), 2 * given);
  const auto stretch_now = [&] {
    return service.get(session).scene().sheets(0).textile().raw().stretch_n_per_m();
  };
  EXPECT_EQ(stretch_now(), given);
  service.step(session, 3);
  EXPECT_DOUBLE_EQ(stretch_now(), 1.5 * given);
  service.step(session, 3);
  EXPECT_EQ(stretch_now(), 2 * given);
}

TEST(UpdateTextile, DoesNotChangeBetweenRawAndMeasuredOverTime) {
  Service service;
  const v1::Session session = service.create();
  auto request = update(session);
  request.mutable_textile()->set_preset("denim_11oz");
  request.set_duration_s(1);
  EXPECT_THAT(service.error(&Sessions::UpdateTextile, request).fields(), ElementsAre("duration_s"));
  request.set_duration_s(0);
  EXPECT_EQ(service.error(&Sessions::UpdateTextile, request).code, grpc::StatusCode::OK);
}

TEST(UpdateTextile, IsRefusedWhereAForcedStepBecomesUnstable) {
  Service service;
  v1::Scene scene = small_scene();
  scene.mutable_solver()->set_substep_s(2e-4);
  const v1::Session session = service.create(scene);
  auto request = update(session, {"raw.stretch_n_per_m"});
  request.mutable_textile()->mutable_raw()->set_stretch_n_per_m(1e7);
  const Error error = service.error(&Sessions::UpdateTextile, request);
  EXPECT_EQ(error.code, grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(error.reason(), "STEP_UNSTABLE");
  EXPECT_EQ(service.step(session).frame(), 1) << "the session is fine";
}

}  // namespace
}  // namespace weft::testing

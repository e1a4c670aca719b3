#include <limits>

#include "tests/support/service/assets.h"
#include "tests/support/service/service.h"

// Code, reason and details of every error.
namespace weft::testing {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using Sessions = Service::Sessions;

void expect_error(const Error& error, grpc::StatusCode code, const std::string& reason) {
  EXPECT_EQ(error.code, code) << error.message;
  EXPECT_EQ(error.reason(), reason);
  EXPECT_EQ(error.info.domain(), "weft.v1");
}

v1::StepSessionRequest step_request(const v1::Session& session) {
  v1::StepSessionRequest request;
  request.set_name(session.name());
  return request;
}

TEST(Errors, OfFieldsNameEveryOneWithItsValueAndBound) {
  Service service;
  v1::Scene scene = small_scene();
  scene.mutable_sheets(0)->mutable_grid()->set_spacing_m(-3);
  scene.mutable_sheets(0)->mutable_textile()->mutable_raw()->set_bend_n_m2(11);
  scene.mutable_solver()->set_integrator(static_cast<v1::Integrator>(77));
  scene.add_colliders();
  const Error error = service.create_error(scene);
  expect_error(error, grpc::StatusCode::INVALID_ARGUMENT, "FIELD_INVALID");
  EXPECT_THAT(error.fields(),
              ::testing::UnorderedElementsAre("session.scene.sheets[0].grid.spacing_m",
                                              "session.scene.sheets[0].textile.raw.bend_n_m2",
                                              "session.scene.solver.integrator",
                                              "session.scene.colliders[0].shape"));
  for (const auto& violation : error.bad.field_violations()) {
    if (!violation.field().ends_with("bend_n_m2")) continue;
    EXPECT_THAT(violation.description(), HasSubstr("11"));
    EXPECT_THAT(violation.description(), HasSubstr("0 to 10"));
  }
}

TEST(Errors, OfAMissingSceneSheetOrTextileNameIt) {
  Service service;
  const Error no_scene = service.error(&Sessions::CreateSession, v1::CreateSessionRequest());
  expect_error(no_scene, grpc::StatusCode::INVALID_ARGUMENT, "FIELD_INVALID");
  EXPECT_THAT(no_scene.fields(), ElementsAre("session.scene"));
  EXPECT_THAT(service.create_error({}).fields(), ElementsAre("session.scene.sheets"));
  v1::Scene empty_sheet;
  empty_sheet.add_sheets();
  EXPECT_THAT(service.create_error(empty_sheet).fields(),
              ElementsAre("session.scene.sheets[0].mesh", "session.scene.sheets[0].textile"));
}

TEST(Errors, AreWarningsThatACallRefuses) {
  Service service;
  v1::Scene scene = small_scene();
  auto* ball = scene.add_colliders()->mutable_sphere();
  ball->set_radius_m(0.06);
  service.create(scene, "pushed-out");

  v1::CreateSessionRequest request;
  *request.mutable_session()->mutable_scene() = scene;
  request.add_refused_warnings("TANGLED_START");
  request.add_refused_warnings("STARTS_INSIDE");
  const Error error = service.error(&Sessions::CreateSession, request);
  expect_error(error, grpc::StatusCode::INVALID_ARGUMENT, "FIELD_INVALID");
  EXPECT_THAT(error.fields(), ElementsAre("session.scene.colliders[0]"));
  EXPECT_THAT(error.bad.field_violations(0).description(),
              AllOf(HasSubstr("STARTS_INSIDE"), HasSubstr("start inside, the first of them ")));

  ball->mutable_center_m()->set_y(-1);
  *request.mutable_session()->mutable_scene() = scene;
  EXPECT_EQ(service.error(&Sessions::CreateSession, request).code, grpc::StatusCode::OK);

  request.add_refused_warnings("INSIDE");
  EXPECT_THAT(service.error(&Sessions::CreateSession, request).fields(),
              ElementsAre("refused_warnings[2]"));
}

TEST(Errors, OfBodiesNameThePlaceWhereTheyAreOpen) {
  Service service;
  v1::Scene scene = small_scene();
  v1::MeshData& mesh = *scene.add_colliders()->mutable_mesh()->mutable_data();
  mesh = cube_mesh(0.1F, 0, -1, 0);
  mesh.mutable_triangles()->resize(11 * 12);
  const Error error = service.create_error(scene);
  expect_error(error, grpc::StatusCode::INVALID_ARGUMENT, "FIELD_INVALID");
  EXPECT_THAT(error.fields(), Contains("session.scene.colliders[0].mesh.data.triangles"));
  EXPECT_THAT(error.bad.field_violations(0).description(), HasSubstr("open"));
  scene.mutable_colliders(0)->mutable_mesh()->set_asset("assets/none");
  EXPECT_THAT(service.create_error(scene).fields(),
              ElementsAre("session.scene.colliders[0].mesh.asset"));
  scene.mutable_colliders(0)->mutable_mesh()->clear_source();
  EXPECT_THAT(service.create_error(scene).fields(),
              ElementsAre("session.scene.colliders[0].mesh.source"));
  *scene.mutable_colliders(0)->mutable_mesh()->mutable_data() = cube_mesh(0.1F, 0, -1, 0);
  scene.mutable_colliders(0)->mutable_mesh()->set_cell_m(-1);
  EXPECT_THAT(service.create_error(scene).fields(),
              ElementsAre("session.scene.colliders[0].mesh.cell_m"));
}

TEST(Errors, OfPresetsSayWhatTheyLack) {
  Service service;
  v1::Scene scene = small_scene();
  scene.mutable_sheets(0)->mutable_textile()->set_preset("kevlar");
  EXPECT_THAT(service.create_error(scene).fields(),
              ElementsAre("session.scene.sheets[0].textile.preset"));
}

TEST(Errors, WithManyProblemsStaySmallAndSayHowManyAreLeftOut) {
  Service service;
  v1::Scene scene = small_scene();
  const std::string long_name(100'000, 'X');
  scene.mutable_sheets(0)->set_name(long_name);
  for (int i = 0; i < 60; ++i) {
    scene.mutable_sheets(0)->add_start_positions_m(std::numeric_limits<double>::infinity());
  }
  v1::CreateSessionRequest request;
  *request.mutable_session()->mutable_scene() = scene;
  v1::Session session;
  const grpc::Status status = service.call(&Sessions::CreateSession, request, &session);
  const Error error(status);
  expect_error(error, grpc::StatusCode::INVALID_ARGUMENT, "FIELD_INVALID");
  EXPECT_LE(error.bad.field_violations_size(), 20);
  EXPECT_GE(error.bad.field_violations_size(), 10);
  EXPECT_LE(status.error_details().size(), 4096u);
  EXPECT_EQ(error.metadata("violations"), "61");
  EXPECT_THAT(error.message,
              HasSubstr(std::to_string(61 - error.bad.field_violations_size()) + " of them not"));
}

TEST(Errors, OfAStepThatIsTooLongNameWhatWasAskedAndTheBound) {
  Service service;
  v1::Scene scene = small_scene();
  scene.mutable_solver()->set_substep_s(0.01);
  const Error error = service.create_error(scene);
  expect_error(error, grpc::StatusCode::INVALID_ARGUMENT, "STEP_UNSTABLE");
  EXPECT_GT(std::stod(error.metadata("asked")), std::stod(error.metadata("bound")));
  EXPECT_THAT(error.fields(), ElementsAre("session.scene.solver.substep_s"));
  scene.mutable_solver()->set_allow_unstable(true);
  EXPECT_EQ(service.create_error(scene).code, grpc::StatusCode::OK);
}

TEST(Errors, OfAFrameWithTooManySubstepsNameHowManyItWouldNeed) {
  Service service;
  v1::Scene scene = small_scene();
  scene.mutable_solver()->set_frame_step_s(10);
  scene.mutable_solver()->set_substep_s(1e-6);
  const Error error = service.create_error(scene);
  expect_error(error, grpc::StatusCode::INVALID_ARGUMENT, "FIELD_INVALID");
  EXPECT_THAT(error.fields(), ElementsAre("session.scene.solver.frame_step_s"));
  EXPECT_THAT(error.bad.field_violations(0).description(), HasSubstr("10000000 substeps"));
  EXPECT_THAT(error.bad.field_violations(0).description(), HasSubstr("1000000 "));
}

TEST(Errors, OfNamesTellBadOnesFromMissingOnes) {
  Service service;
  v1::GetSessionRequest request;
  for (const char* name : {"", "curtain", "sessions/", "sessions/Curtain", "sessions/1"}) {
    request.set_name(name);
    const Error error = service.error(&Sessions::GetSession, request);
    expect_error(error, grpc::StatusCode::INVALID_ARGUMENT, "FIELD_INVALID");
    EXPECT_THAT(error.fields(), ElementsAre("name"));
  }
  request.set_name("sessions/curtain");
  const Error error = service.error(&Sessions::GetSession, request);
  expect_error(error, grpc::StatusCode::NOT_FOUND, "SESSION_NOT_FOUND");
  EXPECT_EQ(error.resource.resource_name(), "sessions/curtain");
  EXPECT_EQ(error.resource.resource_type(), "weft.v1/Session");
}

TEST(Errors, OfANameThatIsTaken) {
  Service service;
  service.create(small_scene(), "curtain");
  const Error error = service.create_error(small_scene(), "curtain");
  expect_error(error, grpc::StatusCode::ALREADY_EXISTS, "SESSION_EXISTS");
  EXPECT_EQ(error.resource.resource_name(), "sessions/curtain");
  EXPECT_THAT(service.create_error(small_scene(), "Curtain!").fields(), ElementsAre("session_id"));
}

TEST(Errors, OfSteppingARunningSession) {
  Service service;
  const v1::Session session = service.create();
  service.run(session, 1'000'000'000);
  expect_error(service.error(&Sessions::StepSession, step_request(session)),
               grpc::StatusCode::FAILED_PRECONDITION, "SESSION_RUNNING");
}

TEST(Errors, OfAStaleFrameNameTheNewest) {
  Service service;
  const v1::Session session = service.create();
  service.step(session, 3);
  auto request = step_request(session);
  request.set_expected_frame(2);
  const Error error = service.error(&Sessions::StepSession, request);
  expect_error(error, grpc::StatusCode::ABORTED, "FRAME_STALE");
  EXPECT_EQ(error.metadata("latest_frame"), "3");
}

TEST(Errors, OfASolverThatDivergedNameTheLastGoodFrame) {
  Service service;
  const v1::Session session = service.create(diverging_scene());
  auto request = step_request(session);
  request.set_frames(100'000);
  const Error error = service.error(&Sessions::StepSession, request);
  expect_error(error, grpc::StatusCode::FAILED_PRECONDITION, "SOLVER_FAILED");
  const v1::Session failed = service.get(session);
  EXPECT_EQ(failed.state(), v1::SESSION_STATE_FAILED);
  EXPECT_EQ(error.metadata("latest_frame"), std::to_string(failed.frame()));
  EXPECT_EQ(failed.failure(), error.message);
  v1::RunSessionRequest run;
  run.set_name(session.name());
  expect_error(service.error(&Sessions::RunSession, run), grpc::StatusCode::FAILED_PRECONDITION,
               "SOLVER_FAILED");
}

TEST(Errors, OfNumbersInRequestsNameTheirField) {
  Service service;
  const v1::Session session = service.create();
  for (const std::int64_t frames : {0, -1, 100'001}) {
    auto step = step_request(session);
    step.set_frames(frames);
    EXPECT_THAT(service.error(&Sessions::StepSession, step).fields(), ElementsAre("frames"));
  }
  v1::RunSessionRequest run;
  run.set_name(session.name());
  for (const double scale : {0.0, -1.0, 1e300, std::nan("")}) {
    run.set_time_scale(scale);
    EXPECT_THAT(service.error(&Sessions::RunSession, run).fields(), ElementsAre("time_scale"));
  }
  run.clear_time_scale();
  run.set_until_frame(0);
  EXPECT_THAT(service.error(&Sessions::RunSession, run).fields(), ElementsAre("until_frame"));
  v1::ListSessionsRequest list;
  list.set_page_size(-1);
  EXPECT_THAT(service.error(&Sessions::ListSessions, list).fields(), ElementsAre("page_size"));
  list.set_page_size(0);
  list.set_page_token("!");
  EXPECT_THAT(service.error(&Sessions::ListSessions, list).fields(), ElementsAre("page_token"));
}

TEST(Errors, OfLimitsNameTheQuota) {
  ServerOptions options = Service::in_process();
  options.limits.max_sessions = 1;
  options.limits.max_particles_per_session = 20;
  Service service(options);
  v1::Scene large = small_scene();
  large.mutable_sheets(0)->mutable_grid()->set_rows(5);
  const Error particles = service.create_error(large);
  expect_error(particles, grpc::StatusCode::RESOURCE_EXHAUSTED, "QUOTA_EXCEEDED");
  EXPECT_EQ(particles.quota.violations(0).subject(), "particles_per_session");
  EXPECT_FALSE(particles.retry) << "later it is as large as now";
  service.create();
  const Error sessions = service.create_error(small_scene());
  expect_error(sessions, grpc::StatusCode::RESOURCE_EXHAUSTED, "QUOTA_EXCEEDED");
  EXPECT_EQ(sessions.quota.violations(0).subject(), "sessions");
  EXPECT_TRUE(sessions.retry);
}

TEST(Errors, OfFramesThatCostTooMuchSayHowMuchAndHowMuchIsAllowed) {
  Service unlimited;
  const auto substeps = [&](const v1::Scene& scene) {
    return unlimited.create(scene).plan().substeps_per_frame();
  };
  const v1::Scene scene = small_scene();
  const std::int64_t most = substeps(scene);
  ServerOptions options = Service::in_process();
  options.limits.max_frame_work = 20 * most + 19;
  Service service(options);
  EXPECT_EQ(service.info().limits().max_frame_work(), 20 * most + 19);
  const v1::Session session = service.create(scene);
  const auto expect_refused = [&](const Error& error) {
    expect_error(error, grpc::StatusCode::RESOURCE_EXHAUSTED, "QUOTA_EXCEEDED");
    EXPECT_EQ(error.quota.violations(0).subject(), "frame_work");
    EXPECT_THAT(error.message, HasSubstr("of 20 particles"));
    EXPECT_THAT(error.message, HasSubstr("computes " + std::to_string(most) + " of so many"));
    EXPECT_FALSE(error.retry);
  };

  v1::Scene longer = scene;
  longer.mutable_solver()->set_frame_step_s(2 * session.scene().solver().frame_step_s());
  const Error created = service.create_error(longer);
  expect_refused(created);
  EXPECT_THAT(created.message, HasSubstr(std::to_string(substeps(longer)) + " substeps"));
  EXPECT_THAT(created.message, HasSubstr("session.scene.solver.frame_step_s"));

  v1::UpdateTextileRequest update;
  update.set_name(session.name());
  update.mutable_textile()->mutable_raw()->set_stretch_n_per_m(1e6);
  update.mutable_update_mask()->add_paths("raw.stretch_n_per_m");
  expect_refused(service.error(&Sessions::UpdateTextile, update));
  service.step(session, 3);
}

TEST(Errors, OfAServerThatDrainsSaySo) {
  Service service;
  const v1::Session session = service.create();
  Stream stream(service, frames_of(session));
  service.run(session, 1'000'000'000);
  std::int64_t last = 0;
  while ((last = stream.frame().number()) < 5) {
  }
  std::jthread stopping([&] { service.server.stop(); });
  const auto rest = stream.rest();
  if (!rest.empty()) last = rest.back().number();
  const Error error = stream.finish();
  expect_error(error, grpc::StatusCode::UNAVAILABLE, "SERVER_DRAINING");
  EXPECT_TRUE(error.retry);
  EXPECT_EQ(error.metadata("last_frame"), std::to_string(last));
}

}  // namespace
}  // namespace weft::testing

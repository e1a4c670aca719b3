#include <Eigen/Geometry>
#include <algorithm>
#include <cstring>
#include <thread>

#include "tests/support/service/service.h"

namespace weft::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

// Room for a few frames of the small scene.
ServerOptions little_history() {
  ServerOptions options = Service::in_process();
  options.limits.history_bytes_per_session = 20'000;
  return options;
}

// 4 x 5 and 4 x 6 particles.
v1::Scene two_sheets() {
  v1::Scene scene = small_scene();
  *scene.add_sheets() = scene.sheets(0);
  scene.mutable_sheets(1)->mutable_grid()->set_columns(6);
  return scene;
}

void expect_numbers(const std::vector<v1::Frame>& frames, std::int64_t first, std::int64_t last) {
  ASSERT_THAT(frames, SizeIs(last - first + 1));
  for (const auto& frame : frames) EXPECT_EQ(frame.number(), first++);
}

std::vector<float> floats(const std::string& bytes) {
  std::vector<float> values(bytes.size() / sizeof(float));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

std::vector<double> doubles(const std::string& bytes) {
  std::vector<double> values(bytes.size() / sizeof(double));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

TEST(StreamFrames, SendsAHeaderAndThenEveryFrameInOrder) {
  Service service;
  const v1::Session session = service.create(two_sheets());
  service.step(session, 5);
  Stream stream(service, frames_of(session, 0, 5));
  const v1::StreamHeader header = stream.header();
  EXPECT_EQ(header.session(), session.name());
  EXPECT_EQ(header.uid(), session.uid());
  EXPECT_EQ(header.numerics_id(), service.info().numerics_id());
  EXPECT_EQ(header.frame_step_s(), 1.0 / 60);
  EXPECT_EQ(header.format().encoding(), v1::FRAME_ENCODING_FLOAT64);
  ASSERT_EQ(header.sheets_size(), 2);
  EXPECT_EQ(header.sheets(1).name(), "sheet-2");
  EXPECT_EQ(header.sheets(1).first_particle(), 20);
  EXPECT_EQ(header.sheets(1).rows(), 4);
  EXPECT_EQ(header.sheets(1).columns(), 6);
  const auto frames = stream.rest();
  expect_numbers(frames, 0, 5);
  EXPECT_THAT(frames[3].positions_m(), SizeIs(3 * 44 * sizeof(double)));
  EXPECT_EQ(stream.finish().code, grpc::StatusCode::OK);
}

TEST(StreamFrames, SendsWhatTheFormatAsksForAndNoMore) {
  Service service;
  const v1::Session session = service.create();
  service.step(session, 3);
  v1::StreamFramesRequest request;
  request.set_session(session.name());
  Stream plain(service, request);
  EXPECT_EQ(plain.header().format().encoding(), v1::FRAME_ENCODING_FLOAT32);
  const v1::Frame single = plain.frame();
  EXPECT_EQ(single.number(), 3) << "without start_frame: the newest";
  EXPECT_TRUE(single.velocities_m_per_s().empty());
  EXPECT_FALSE(single.has_stats());
  request.mutable_format()->set_encoding(v1::FRAME_ENCODING_FLOAT64);
  request.mutable_format()->set_velocities(true);
  request.mutable_format()->set_stats(true);
  const v1::Frame full = Stream(service, request).frame();
  EXPECT_THAT(full.velocities_m_per_s(), SizeIs(3 * 20 * sizeof(double)));
  EXPECT_GT(full.stats().kinetic_energy_j(), 0);
  EXPECT_EQ(full.stats().substep_count(), session.plan().substeps_per_frame());
  const auto exact = doubles(full.positions_m());
  EXPECT_EQ(floats(single.positions_m()), std::vector<float>(exact.begin(), exact.end()));
}

TEST(StreamFrames, SendsThePartOfTheParticlesThatIsAskedFor) {
  Service service;
  const v1::Session session = service.create();
  auto request = frames_of(session, 0, 0);
  const auto all = doubles(Stream(service, request).frame().positions_m());
  request.mutable_format()->set_first_particle(5);
  request.mutable_format()->set_particle_count(12);
  request.mutable_format()->set_stride(4);
  const auto some = doubles(Stream(service, request).frame().positions_m());
  ASSERT_THAT(some, SizeIs(3 * 3));
  for (std::size_t i = 0; i < some.size(); ++i) EXPECT_EQ(some[i], all[i / 3 * 20 + 5 + i % 3 * 4]);
  request.mutable_format()->set_particle_count(16);
  EXPECT_THAT(Stream(service, request).finish().fields(), ElementsAre("format.particle_count"));
}

TEST(StreamFrames, ResumedAfterABreakHasEveryFrameOnceAndBitEqual) {
  Service service;
  const v1::Session session = service.create();
  Stream undisturbed(service, frames_of(session, 0, 300));
  std::vector<v1::Frame> received;
  service.run(session, 300);
  while (received.size() < 301) {
    const auto next = static_cast<std::int64_t>(received.size());
    Stream stream(service, frames_of(session, next, 300));
    for (int i = 0; i < 70 && received.size() < 301; ++i) received.push_back(stream.frame());
  }
  expect_numbers(received, 0, 300);
  const auto all = undisturbed.rest();
  ASSERT_THAT(all, SizeIs(301));
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(received[i].SerializeAsString(), all[i].SerializeAsString());
  }
}

TEST(StreamFrames, OfManyWatchersAreEqual) {
  Service service;
  const v1::Session session = service.create();
  std::vector<std::jthread> watchers;
  std::vector<std::vector<v1::Frame>> frames(8);
  for (auto& mine : frames) {
    watchers.emplace_back([&] { mine = Stream(service, frames_of(session, 0, 60)).rest(); });
  }
  service.run(session, 60);
  watchers.clear();
  expect_numbers(frames[0], 0, 60);
  for (const auto& mine : frames) {
    ASSERT_THAT(mine, SizeIs(61));
    EXPECT_EQ(mine[60].SerializeAsString(), frames[0][60].SerializeAsString());
  }
}

TEST(StreamFrames, WaitsForAFrameThatLiesAhead) {
  Service service;
  const v1::Session session = service.create();
  Stream stream(service, frames_of(session, 7, 8));
  EXPECT_EQ(stream.header().start_frame(), 7);
  service.step(session, 10);
  expect_numbers(stream.rest(), 7, 8);
}

TEST(StreamFrames, EndsASlowReaderThatDoesNotHoldTheSession) {
  Service service(little_history());
  const v1::Session session = service.create();
  Stream stream(service, frames_of(session));
  stream.header();
  service.step(session, 2000);
  const auto frames = stream.rest();
  expect_numbers(frames, 0, static_cast<std::int64_t>(frames.size()) - 1);
  const Error error = stream.finish();
  EXPECT_EQ(error.code, grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_EQ(error.reason(), "FRAME_EXPIRED");
  const std::int64_t oldest = std::stoll(error.metadata("oldest_frame"));
  EXPECT_GT(oldest, static_cast<std::int64_t>(frames.size()));
  EXPECT_LT(oldest, std::stoll(error.metadata("latest_frame")));
}

TEST(StreamFrames, LosesNothingForASlowReaderThatHoldsTheSession) {
  Service service(little_history());
  const v1::Session session = service.create();
  auto request = frames_of(session, 0, 2000);
  request.set_slow_reader(v1::SLOW_READER_HOLD_SESSION);
  Stream stream(service, request);
  stream.header();
  std::jthread stepping([&] { service.step(session, 2000); });
  expect_numbers(stream.rest(), 0, 2000);
}

TEST(StreamFrames, ReleasesTheSessionWhenAReaderThatHoldsItVanishes) {
  Service service(little_history());
  const v1::Session session = service.create();
  auto request = frames_of(session);
  request.set_slow_reader(v1::SLOW_READER_HOLD_SESSION);
  auto stream = std::make_unique<Stream>(service, request);
  stream->header();
  std::jthread stepping([&] { EXPECT_EQ(service.step(session, 2000).frame(), 2000); });
  while (stream->frame().number() < 50) {
  }
  stream.reset();
}

TEST(StreamFrames, RefusesFramesThatAreNoLongerKept) {
  Service service(little_history());
  const v1::Session session = service.create();
  service.step(session, 100);
  const Error error = Stream(service, frames_of(session)).finish();
  EXPECT_EQ(error.code, grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_EQ(error.reason(), "FRAME_EXPIRED");
  EXPECT_EQ(error.metadata("latest_frame"), "100");
  const std::int64_t oldest = std::stoll(error.metadata("oldest_frame"));
  EXPECT_EQ(Stream(service, frames_of(session, oldest)).frame().number(), oldest);
}

TEST(StreamFrames, EndsWithItsSession) {
  Service service;
  const v1::Session session = service.create();
  Stream stream(service, frames_of(session));
  stream.frame();
  service.erase(session);
  const Error error = stream.finish();
  EXPECT_EQ(error.code, grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(error.reason(), "SESSION_NOT_FOUND");
}

TEST(StreamFrames, EndsAfterTheLastGoodFrameOfASolverThatDiverged) {
  Service service;
  const v1::Session session = service.create(diverging_scene());
  Stream stream(service, frames_of(session));
  service.run(session, 100'000);
  const auto frames = stream.rest();
  expect_numbers(frames, 0, service.get(session).frame());
  const Error error = stream.finish();
  EXPECT_EQ(error.code, grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(error.reason(), "SOLVER_FAILED");
  EXPECT_EQ(error.metadata("latest_frame"), std::to_string(frames.back().number()));
  EXPECT_THAT(Stream(service, frames_of(session, 0, 0)).rest(), SizeIs(1))
      << "the good frames stay readable";
}

TEST(StreamFrames, TellsOfARepairRightAfterTheFrameThatTookIt) {
  Service service;
  v1::Scene scene = diverging_scene();
  scene.mutable_solver()->clear_max_repairs();
  const v1::Session session = service.create(scene);
  auto request = frames_of(session, 0, 40);
  request.mutable_format()->set_stats(true);
  Stream stream(service, request);
  service.run(session, 40);
  std::vector<v1::Repair> told;
  std::int64_t frame = -1, owed = 0;
  while (const auto message = stream.read()) {
    if (message->has_frame()) {
      EXPECT_EQ(owed, 0) << "before frame " << message->frame().number();
      frame = message->frame().number();
      owed = message->frame().stats().repair_count();
    } else if (message->has_repair()) {
      EXPECT_EQ(message->repair().frame(), frame);
      EXPECT_NE(message->repair().reason(), "");
      --owed;
      told.push_back(message->repair());
    }
  }
  EXPECT_EQ(frame, 40);
  EXPECT_EQ(owed, 0);
  const v1::Session now = service.get(session);
  EXPECT_EQ(now.state(), v1::SESSION_STATE_PAUSED);
  ASSERT_EQ(static_cast<std::size_t>(now.repairs_size()), told.size());
  ASSERT_FALSE(told.empty()) << "0.05 s is 8 times what is stable";
  EXPECT_EQ(now.plan().substep_s(), told.back().substep_s());
}

TEST(StreamFrames, ReportsProgressWhenTheStateChangesAndWhileNothingHappens) {
  Service service;
  const v1::Session session = service.create();
  Stream stream(service, frames_of(session));
  stream.header();
  EXPECT_TRUE(stream.read()->has_frame());
  const auto idle = stream.read();  // two seconds later
  ASSERT_TRUE(idle && idle->has_progress());
  EXPECT_EQ(idle->progress().state(), v1::SESSION_STATE_PAUSED);
  service.run(session, 40);
  std::optional<v1::StreamFramesResponse> message;
  std::int64_t frame = 0;
  while ((message = stream.read()) && !(message->has_progress() && frame == 40)) {
    if (message->has_frame()) frame = message->frame().number();
  }
  ASSERT_TRUE(message);
  EXPECT_EQ(message->progress().state(), v1::SESSION_STATE_PAUSED);
  EXPECT_EQ(message->progress().latest_frame(), 40);
}

TEST(StreamFrames, RefusesRequestsThatMakeNoSense) {
  Service service;
  const v1::Session session = service.create();
  const auto fields_of = [&](const v1::StreamFramesRequest& request) {
    const Error error = Stream(service, request).finish();
    EXPECT_EQ(error.code, grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_EQ(error.reason(), "FIELD_INVALID");
    return error.fields();
  };
  EXPECT_THAT(fields_of(frames_of(session, -1)), ElementsAre("start_frame"));
  EXPECT_THAT(fields_of(frames_of(session, 5, 4)), ElementsAre("end_frame"));
  auto request = frames_of(session);
  request.mutable_format()->set_encoding(static_cast<v1::FrameEncoding>(9));
  request.set_slow_reader(static_cast<v1::SlowReader>(9));
  EXPECT_THAT(fields_of(request), ElementsAre("slow_reader", "format.encoding"));
  request = frames_of(session);
  request.set_session("x");
  EXPECT_THAT(fields_of(request), ElementsAre("session"));
}

TEST(StreamFrames, RefusesTheUidOfAnotherSessionOfThatName) {
  Service service;
  const v1::Session old = service.create(small_scene(), "curtain");
  service.erase(old);
  const v1::Session now = service.create(small_scene(), "curtain");
  const Error error = Stream(service, frames_of(old)).finish();
  EXPECT_EQ(error.code, grpc::StatusCode::ABORTED);
  EXPECT_EQ(error.reason(), "UID_CHANGED");
  EXPECT_EQ(error.metadata("uid"), now.uid());
}

TEST(StreamFrames, SendsAFrameThatFitsNoMessageInSeveral) {
  ServerOptions options = Service::in_process();
  options.limits.max_frame_bytes = 1024;
  Service service(options);
  const v1::Session session = service.create();
  service.step(session, 2);
  auto request = frames_of(session, 0, 2);
  const auto small = Stream(service, request).rest();
  expect_numbers(small, 0, 2);
  request.mutable_format()->set_velocities(true);
  request.mutable_format()->set_stats(true);
  const auto parts = Stream(service, request).rest();
  ASSERT_THAT(parts, SizeIs(6));
  for (std::size_t i = 0; i < parts.size(); ++i) {
    EXPECT_EQ(parts[i].number(), static_cast<std::int64_t>(i) / 2);
    EXPECT_EQ(parts[i].continued(), i % 2 == 0);
    EXPECT_LE(parts[i].ByteSizeLong(), 1024);
  }
  EXPECT_EQ(parts[4].positions_m() + parts[5].positions_m(), small[2].positions_m());
  EXPECT_THAT(parts[4].velocities_m_per_s() + parts[5].velocities_m_per_s(),
              SizeIs(3 * 20 * sizeof(double)));
  EXPECT_EQ(parts[5].stats().substep_count(), session.plan().substeps_per_frame());
}

TEST(StreamFrames, ReachesClientsWithGrpcsUsualLimitsFromSheetsOfAnySize) {
  Service service(ServerOptions{});
  v1::Scene scene = small_scene();
  scene.mutable_sheets(0)->mutable_grid()->set_rows(245);
  scene.mutable_sheets(0)->mutable_grid()->set_columns(245);
  const v1::Session session = service.create(scene);
  grpc::ClientContext context;
  const auto frames = v1::FrameService::NewStub(
      grpc::CreateChannel(service.server.address(), grpc::InsecureChannelCredentials()));
  auto request = frames_of(session, 0, 0);
  request.mutable_format()->set_velocities(true);
  request.mutable_format()->set_normals(true);
  const auto reader = frames->StreamFrames(&context, request);
  std::size_t bytes = 0;
  for (v1::StreamFramesResponse message; reader->Read(&message);)
    bytes += message.frame().ByteSizeLong();
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_GT(bytes, 4 << 20);
}

TEST(StreamFrames, SendsNormalsOfEachSheet) {
  Service service;
  const v1::Session session = service.create(two_sheets());
  service.step(session, 30);
  auto request = frames_of(session, 30, 30);
  request.mutable_format()->set_normals(true);
  const v1::Frame frame = Stream(service, request).frame();
  const auto x = doubles(frame.positions_m()), n = doubles(frame.normals());
  ASSERT_THAT(n, SizeIs(3 * 44));
  const auto at = [](const std::vector<double>& values, std::size_t particle) {
    return Eigen::Vector3d(values[particle], values[44 + particle], values[88 + particle]);
  };
  const auto expect_normal = [&](std::size_t of, std::size_t right, std::size_t left,
                                 std::size_t below, std::size_t above) {
    EXPECT_NEAR(at(n, of).norm(), 1, 1e-14);
    EXPECT_NEAR(at(n, of).dot((at(x, right) - at(x, left)).normalized()), 0, 1e-14);
    EXPECT_NEAR(at(n, of).dot((at(x, below) - at(x, above)).normalized()), 0, 1e-14);
  };
  expect_normal(7, 8, 6, 12, 2);
  expect_normal(20 + 8, 20 + 9, 20 + 7, 20 + 14, 20 + 2);
  expect_normal(20, 21, 20, 26, 20);  // a corner
}

// The second sheet lies on a table.
v1::Scene on_a_table() {
  v1::Scene scene = two_sheets();
  scene.mutable_sheets(1)->clear_pins();
  scene.mutable_sheets(1)->mutable_placement()->mutable_origin_m()->set_y(-0.2);
  scene.add_colliders()->mutable_plane()->mutable_point_m()->set_y(-0.21);
  return scene;
}

v1::StreamFramesRequest pressed(const v1::Session& session, std::int64_t frame) {
  auto request = frames_of(session, frame, frame);
  request.mutable_format()->set_pressure(true);
  request.mutable_format()->set_clearance(true);
  return request;
}

TEST(StreamFrames, SendsWhatCollidersPressWithAndHowFarTheyAre) {
  Service service;
  const v1::Session session = service.create(on_a_table());
  service.step(session, 120);
  auto request = pressed(session, 120);
  const v1::Frame frame = Stream(service, request).frame();
  const auto x = doubles(frame.positions_m()), pressure = doubles(frame.pressure_pa()),
             clearance = doubles(frame.clearance_m());
  ASSERT_THAT(pressure, SizeIs(44));
  ASSERT_THAT(clearance, SizeIs(44));
  for (std::size_t i = 0; i < 44; ++i) {
    EXPECT_NEAR(clearance[i], x[44 + i] + 0.21, 1e-12);
    if (i < 20) {
      EXPECT_EQ(pressure[i], 0);
    }
  }
  const std::size_t inner = 20 + 6 + 2;  // a cell's area is its own
  EXPECT_NEAR(pressure[inner], 1e-3 * 9.80665 / (0.05 * 0.05), 0.01 * pressure[inner]);
  v1::GetVerdictRequest ask;
  ask.set_name(session.name());
  v1::Verdict verdict;
  ASSERT_TRUE(service.call(&Service::Sessions::GetVerdict, ask, &verdict).ok());
  EXPECT_EQ(verdict.largest_pressure_pa(), *std::max_element(pressure.begin(), pressure.end()));

  request.mutable_format()->set_first_particle(21);
  request.mutable_format()->set_stride(2);
  const v1::Frame some = Stream(service, request).frame();
  ASSERT_THAT(doubles(some.clearance_m()), SizeIs(12));
  EXPECT_EQ(doubles(some.clearance_m())[3], clearance[27]);
  EXPECT_EQ(doubles(some.pressure_pa())[3], pressure[27]);
}

TEST(StreamFrames, OfEarlierFramesThePressureIsWhatItWasAndThatOfTheirTextile) {
  Service service;
  const v1::Session session = service.create(on_a_table());
  service.step(session, 60);
  const v1::Frame frame = Stream(service, pressed(session, 60)).frame();
  v1::UpdateTextileRequest heavier;
  heavier.set_name(session.name());
  heavier.set_sheet("sheet-2");
  *heavier.mutable_textile() = session.scene().sheets(1).textile();
  heavier.mutable_textile()->mutable_raw()->set_particle_mass_kg(3e-3);
  v1::UpdateTextileResponse updated;
  ASSERT_TRUE(service.call(&Service::Sessions::UpdateTextile, heavier, &updated).ok());
  service.step(session, 60);
  auto request = pressed(session, 60);
  request.mutable_format()->set_velocities(true);  // encoded anew
  EXPECT_EQ(Stream(service, request).frame().pressure_pa(), frame.pressure_pa());
  const auto pressure = [](const v1::Frame& of) { return doubles(of.pressure_pa())[32]; };
  EXPECT_NEAR(pressure(Stream(service, pressed(session, 120)).frame()), 3 * pressure(frame),
              0.1 * pressure(frame));
}

TEST(StreamFrames, RefusesClearanceWhereThereIsNoCollider) {
  Service service;
  const v1::Session session = service.create();
  const Error error = Stream(service, pressed(session, 0)).finish();
  EXPECT_THAT(error.fields(), ElementsAre("format.clearance"));
}

TEST(StreamFrames, RefusesMoreStreamsThanItsLimit) {
  ServerOptions options = Service::in_process();
  options.limits.max_streams = 2;
  Service service(options);
  const v1::Session session = service.create();
  Stream one(service, frames_of(session)), two(service, frames_of(session));
  one.frame();
  two.frame();
  const Error error = Stream(service, frames_of(session)).finish();
  EXPECT_EQ(error.code, grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(error.quota.violations(0).subject(), "streams");
  EXPECT_TRUE(error.retry);
}

TEST(StreamFrames, RefusesBytesThatAreNoRequest) {
  Service service;
  const Error error =
      raw_call(service, "/weft.v1.FrameService/StreamFrames", "\xff\xff\xff\xff").second;
  EXPECT_EQ(error.code, grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(error.reason(), "MESSAGE_MALFORMED");
}

}  // namespace
}  // namespace weft::testing

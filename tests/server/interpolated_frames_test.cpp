#include <gmock/gmock.h>

#include <cstring>

#include "tests/support/service/service.h"

namespace weft::testing {
namespace {

using ::testing::ElementsAre;
using Sessions = Service::Sessions;

constexpr int kSide = 41, kEvery = 4, kCoarse = 11;

// Wool of 0.4 m that hangs from one border over a ball; of `every`-th rows and columns.
v1::Scene wool(int side, double spacing_m, int every) {
  v1::Scene scene;
  v1::Sheet& sheet = *scene.add_sheets();
  sheet.mutable_grid()->set_rows(side);
  sheet.mutable_grid()->set_columns(side);
  sheet.mutable_grid()->set_spacing_m(spacing_m);
  if (every > 1) sheet.mutable_grid()->set_simulated_every(every);
  sheet.mutable_textile()->set_preset("wool_tropical");
  sheet.mutable_placement()->mutable_origin_m()->set_y(0.3);
  sheet.set_skin_m(0.001);
  for (int column = 0; column < side; ++column) {
    if (column == 0) sheet.add_pins();
    sheet.mutable_pins(0)->add_particles(column);
  }
  v1::Collider& ball = *scene.add_colliders();
  ball.mutable_sphere()->mutable_center_m()->set_x(0.2);
  ball.mutable_sphere()->mutable_center_m()->set_y(0.15);
  ball.mutable_sphere()->mutable_center_m()->set_z(0.2);
  ball.mutable_sphere()->set_radius_m(0.1);
  return scene;
}
v1::Scene interpolated() { return wool(kSide, 0.01, kEvery); }

v1::StreamFramesRequest all_of(const v1::Session& session, std::int64_t frame) {
  v1::StreamFramesRequest request = frames_of(session, frame, frame);
  v1::FrameFormat& format = *request.mutable_format();
  format.set_encoding(v1::FRAME_ENCODING_FLOAT64);
  format.set_velocities(true);
  format.set_stats(true);
  format.set_normals(true);
  format.set_topology(true);
  format.set_strain(true);
  format.set_pressure(true);
  format.set_clearance(true);
  return request;
}

std::vector<double> numbers(const std::string& bytes) {
  std::vector<double> values(bytes.size() / sizeof(double));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

// Those of particles that are simulated, of planes of all.
std::vector<double> simulated(const std::vector<double>& planes) {
  std::vector<double> values;
  for (std::size_t first = 0; first < planes.size(); first += kSide * kSide)
    for (int row = 0; row < kSide; row += kEvery)
      for (int column = 0; column < kSide; column += kEvery)
        values.push_back(planes[first + static_cast<std::size_t>(row * kSide + column)]);
  return values;
}

TEST(InterpolatedFrames, HaveTheNumbersOfTheCoarserSheetWhereParticlesAreSimulated) {
  Service service;
  const v1::Session fine = service.create(interpolated());
  const v1::Session coarse = service.create(wool(kCoarse, 0.04, 1));
  EXPECT_EQ(fine.plan().particle_substeps_per_second(),
            coarse.plan().particle_substeps_per_second());
  service.step(fine, 30);
  service.step(coarse, 30);

  Stream shown(service, all_of(fine, 30)), solved(service, all_of(coarse, 30));
  const v1::SheetLayout layout = shown.header().sheets(0);
  EXPECT_EQ(layout.rows(), kSide);
  EXPECT_EQ(layout.columns(), kSide);
  EXPECT_EQ(layout.particle_count(), kSide * kSide);
  EXPECT_EQ(layout.triangle_count(), 2 * (kSide - 1) * (kSide - 1));
  EXPECT_EQ(layout.simulated_every(), kEvery);
  const auto topology = shown.read();
  ASSERT_TRUE(topology && topology->has_topology());
  const auto triangles = static_cast<std::size_t>(layout.triangle_count());
  EXPECT_EQ(topology->topology().mesh().triangles().size(), 4 * 3 * triangles);

  const v1::Frame one = shown.frame(), other = solved.frame();
  EXPECT_EQ(simulated(numbers(one.positions_m())), numbers(other.positions_m()));
  EXPECT_EQ(simulated(numbers(one.velocities_m_per_s())), numbers(other.velocities_m_per_s()));
  EXPECT_EQ(simulated(numbers(one.pressure_pa())), numbers(other.pressure_pa()));
  EXPECT_EQ(simulated(numbers(one.clearance_m())), numbers(other.clearance_m()));
  EXPECT_EQ(one.stats().SerializeAsString(), other.stats().SerializeAsString());
  EXPECT_EQ(numbers(one.strain()).size(), 3 * triangles);
  for (const double pressure : numbers(one.pressure_pa())) EXPECT_GE(pressure, 0);
}

TEST(InterpolatedFrames, ShowASmoothSheetOutsideTheBallItLiesOn) {
  Service service;
  const v1::Session session = service.create(interpolated());
  service.step(session, 60);
  const v1::Frame frame = Stream(service, all_of(session, 60)).frame();
  const std::vector<double> x = numbers(frame.positions_m());
  const auto at = [&](int row, int column, int axis) {
    return x[static_cast<std::size_t>((axis * kSide + row) * kSide + column)];
  };
  for (int column = 0; column < kSide; ++column) {  // of the border that is held
    EXPECT_NEAR(at(0, column, 0), 0.01 * column, 1e-12);
    EXPECT_NEAR(at(0, column, 1), 0.3, 1e-12);
  }
  const std::vector<double> clearances = numbers(frame.clearance_m());
  EXPECT_GT(*std::ranges::min_element(clearances), -0.002);
  EXPECT_LT(*std::ranges::min_element(clearances), 0.0015);
}

TEST(InterpolatedFrames, AreOfAScenePassedBackAsItWasGiven) {
  Service service;
  v1::Scene scene = interpolated();
  const v1::Session session = service.create(scene);
  const v1::Sheet& sheet = session.scene().sheets(0);
  EXPECT_EQ(sheet.grid().rows(), kSide);
  EXPECT_EQ(sheet.grid().spacing_m(), 0.01);
  EXPECT_EQ(sheet.grid().simulated_every(), kEvery);
  EXPECT_THAT(sheet.pins(0).particles(), ElementsAre(0, 4, 8, 12, 16, 20, 24, 28, 32, 36, 40));
  bool said = false;
  for (const auto& skipped : session.plan().skipped())
    said |= skipped.pass() == "sheet: 1560 of 1681 particles";
  EXPECT_TRUE(said);

  const v1::Session again = service.create(session.scene());
  service.step(session, 5);
  service.step(again, 5);
  EXPECT_EQ(Stream(service, all_of(session, 5)).frame().SerializeAsString(),
            Stream(service, all_of(again, 5)).frame().SerializeAsString());
}

TEST(InterpolatedFrames, StartWhereTheSimulatedParticlesAreToldTo) {
  Service service;
  v1::Scene scene = interpolated();
  v1::Sheet& sheet = *scene.mutable_sheets(0);
  for (int i = 0; i < kSide * kSide; ++i)
    for (const double value : {0.01 * (i % kSide), 0.35, 0.01 * (i / kSide)})
      sheet.add_start_positions_m(value);
  sheet.set_start_positions_m(3 * 5 + 1, 7);  // between: passed over
  const v1::Session session = service.create(scene);
  const std::vector<double> x = numbers(Stream(service, all_of(session, 0)).frame().positions_m());
  for (std::size_t i = kSide * kSide; i < 2 * kSide * kSide; ++i) EXPECT_NEAR(x[i], 0.35, 1e-15);
}

// What is wrong with it, "field: message".
std::vector<std::string> complaints(const v1::Scene& scene) {
  std::vector<std::string> all;
  const Error error = Service().create_error(scene);
  for (const auto& each : error.bad.field_violations())
    all.push_back(each.field() + ": " + each.description());
  return all;
}

TEST(InterpolatedFrames, AreRefusedWithWhatIsWrongWithTheGrid) {
  const std::string sheet = "session.scene.sheets[0].";
  v1::Scene scene = interpolated();
  scene.mutable_sheets(0)->mutable_grid()->set_simulated_every(3);
  EXPECT_THAT(
      complaints(scene),
      ElementsAre(sheet + "grid.simulated_every: is 3, of which rows - 1 = 40 is no multiple"));
  scene.mutable_sheets(0)->mutable_grid()->set_simulated_every(65);
  EXPECT_THAT(complaints(scene),
              ElementsAre(sheet + "grid.simulated_every: 65 is not within 1 to 64"));
  scene = interpolated();
  scene.mutable_sheets(0)->mutable_pins(0)->clear_particles();
  for (const int particle : {1, 2, 3})
    scene.mutable_sheets(0)->mutable_pins(0)->add_particles(particle);
  EXPECT_THAT(
      complaints(scene),
      ElementsAre(sheet + "pins[0].particles: has none that is simulated: those in each row and "
                          "column number 4 from the first on are"));
  scene.mutable_sheets(0)->mutable_pins(0)->add_particles(1681);
  scene.mutable_sheets(0)->mutable_pins(0)->add_particles(2);
  EXPECT_THAT(complaints(scene),
              ElementsAre(sheet + "pins[0].particles[3]: 1681 is not within 0 to 1680",
                          sheet + "pins[0].particles[4]: 2 is pinned twice"));
  scene = interpolated();
  scene.mutable_sheets(0)->add_start_velocities_m_per_s(1);
  EXPECT_THAT(
      complaints(scene),
      ElementsAre(sheet + "start_velocities_m_per_s: has 1 values; 5043 (3 x particles) or none "
                          "are needed"));
  scene.mutable_sheets(0)->clear_start_velocities_m_per_s();
  for (int i = 0; i < 3 * kSide * kSide; ++i)
    scene.mutable_sheets(0)->add_start_velocities_m_per_s(i == 17 ? 2000 : 0);
  EXPECT_THAT(
      complaints(scene),
      ElementsAre(sheet +
                  "start_velocities_m_per_s[17]: 2000 m/s is not within -1000 to 1000 m/s"));
}

}  // namespace
}  // namespace weft::testing

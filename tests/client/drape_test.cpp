#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <sstream>

#include "client/garments/pattern_file.h"
#include "client/recording/cloth.h"
#include "client/recording/points.h"
#include "client/recording/reader.h"
#include "tests/client/client_test.h"

namespace weft::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kPole = 0.1;  // radius of what is dressed, m

// A closed pole about y, from -1 to 1 m.
std::string pole_obj() {
  constexpr int kSides = 48;
  std::ostringstream text;
  for (const double y : {-1.0, 1.0}) {
    text << "v 0 " << y << " 0\n";
    for (int k = 0; k < kSides; ++k) {
      const double angle = 2 * std::numbers::pi * k / kSides;
      text << "v " << kPole * std::cos(angle) << ' ' << y << ' ' << kPole * std::sin(angle) << '\n';
    }
  }
  for (int k = 0; k < kSides; ++k) {
    const int low = 2 + k, next = 2 + (k + 1) % kSides, up = kSides + 1;
    text << "f 1 " << low << ' ' << next << '\n'
         << "f " << 1 + up << ' ' << next + up << ' ' << low + up << '\n'
         << "f " << low << ' ' << low + up << ' ' << next << '\n'
         << "f " << next << ' ' << low + up << ' ' << next + up << '\n';
  }
  return text.str();
}

// Two rectangles in front of the pole and behind it, sewn at their sides, with a waist on top.
v1::Pattern tube_pattern(double girth, double away = 0.15) {
  v1::Pattern pattern;
  const double half = girth / 4;
  for (const bool back : {false, true}) {
    v1::PatternPanel* panel = pattern.add_panels();
    panel->set_name(back ? "back" : "front");
    const auto edge = [&](double u, double v, const char* label = "") {
      v1::PatternEdge* added = panel->add_edges();
      added->add_points_m(u);
      added->add_points_m(v);
      added->set_label(label);
    };
    edge(half, 0);
    edge(half, 0.2);
    edge(-half, 0.2, "waist");
    edge(-half, 0);
    panel->mutable_placement()->mutable_origin_m()->set_z(back ? -away : away);
    if (back) {
      panel->mutable_placement()->mutable_rotation()->set_w(0);
      panel->mutable_placement()->mutable_rotation()->set_y(1);
    }
  }
  for (const auto& [front, back] : {std::pair(1, 3), std::pair(3, 1)}) {
    v1::PatternSeam* seam = pattern.add_seams();
    seam->add_first_side()->set_panel("front");
    seam->mutable_first_side(0)->set_edge(front);
    seam->add_second_side()->set_panel("back");
    seam->mutable_second_side(0)->set_edge(back);
  }
  return pattern;
}

class Drape : public ClientTest {
 protected:
  Outcome drape(double girth, std::vector<std::string> options, double away = 0.15) {
    write_file(path("pole.obj"), pole_obj());
    write_file(path("tube.json"), client::pattern_text(tube_pattern(girth, away)));
    std::vector<std::string> arguments{"drape",          path("tube.json"), "--body",
                                       path("pole.obj"), "--edge",          "0.03"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return run_weft(arguments);
  }
};

TEST_F(Drape, OfWhatFitsIsGoodAndIsWritten) {
  const Outcome outcome = drape(0.62, {"-o", path("tube.glb"), "--page", path("tube.html"),
                                       "--recording", path("tube.weft"), "--json"});
  ASSERT_EQ(outcome.exit, 0) << outcome.err;
  const nlohmann::json verdict = outcome.json()["verdict"];
  EXPECT_EQ(verdict["good"], true);
  EXPECT_EQ(verdict["at_rest"], true);
  // around a polygon that keeps a skin of 3 mm from the pole
  const double girth = 2 * std::numbers::pi * (kPole + 0.003);
  EXPECT_NEAR(verdict["strain_weft"].get<double>(), girth / 0.62 - 1, 0.02);
  client::RecordingReader recording(path("tube.weft"));
  const auto pressures =
      client::read_pressures(recording.read(recording.last_frame()), recording.header());
  const auto largest = verdict["largest_pressure_pa"].get<double>();
  EXPECT_GT(largest, 0);
  EXPECT_NEAR(*std::max_element(pressures.begin(), pressures.end()), largest, 1e-6 * largest);
  ASSERT_TRUE(recording.verdict());
  EXPECT_TRUE(recording.verdict()->good());
  EXPECT_THAT(run_weft({"info", path("tube.weft")}).out, HasSubstr("verdict           good"));
  for (const char* file : {"tube.glb", "tube.html", "tube.weft"})
    EXPECT_TRUE(std::filesystem::exists(path(file))) << file;
}

TEST_F(Drape, InAScriptGoesOverWhatARecordingHas) {
  ASSERT_EQ(drape(0.62, {"--recording", path("worn.weft")}).exit, 0);
  write_file(path("tube.json"), client::pattern_text(tube_pattern(0.65, 0.1)));
  const auto script = [&](const std::string& create) {
    write_file(path("layers.yaml"), R"(
steps:
  - create: {drape: tube.json, edge_m: 0.03, )" +
                                        create + R"(}
  - record: {file: both.weft}
  - run: {until_time_s: 0.5}
)");
    return weft({"script", path("layers.yaml")});
  };
  const Outcome outcome = script("over: worn.weft");
  ASSERT_EQ(outcome.exit, 0) << outcome.err;
  client::RecordingReader recording(path("both.weft"));
  ASSERT_EQ(recording.header().sheets_size(), 2);
  EXPECT_EQ(recording.header().sheets(0).name(), "tube");
  EXPECT_EQ(recording.header().sheets(1).name(), "tube-2");

  EXPECT_THAT(script("over: worn.weft, body: pole.obj").err,
              HasSubstr("create.over: excludes body: the recording has its own"));
  EXPECT_THAT(script("over: pole.obj").err,
              AllOf(HasSubstr("create.over: "), HasSubstr("pole.obj")));
  write_file(path("alone.yaml"), "steps:\n  - create: {template: flag, over: worn.weft}\n");
  EXPECT_THAT(weft({"script", path("alone.yaml")}).err, HasSubstr("create.over: is for a drape"));
}

TEST_F(Drape, OverWhatIsWornStaysOutsideOfIt) {
  ASSERT_EQ(drape(0.62, {"--recording", path("tube.weft")}).exit, 0);
  const auto over = [&](const std::string& beneath, std::vector<std::string> options) {
    std::vector<std::string> arguments{"drape", path("tube.json"), "--over",
                                       beneath, "--edge",          "0.03"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return run_weft(arguments);
  };
  // its panels would start within the tube that is worn
  write_file(path("tube.json"), client::pattern_text(tube_pattern(0.65, 0.1)));
  const Outcome outcome =
      over(path("tube.weft"), {"--recording", path("both.weft"), "--seconds", "2", "--json"});
  EXPECT_EQ(outcome.json()["verdict"]["cloth_cut_count"], 0) << outcome.err;
  client::RecordingReader recording(path("both.weft"));
  ASSERT_EQ(recording.header().sheets_size(), 2);
  EXPECT_EQ(recording.header().sheets(0).name(), "tube");
  EXPECT_EQ(recording.header().sheets(1).name(), "tube-2");
  const v1::Frame end = recording.read(recording.last_frame());
  const std::size_t inner = client::particle_count(recording.header().sheets(0));
  const client::Points points = client::read_points(end.positions_m(), recording.header());
  const auto radius = [&](std::size_t i) { return std::hypot(points.x[i], points.z[i]); };
  double farthest = 0, low = 1, high = -1;
  for (std::size_t i = 0; i < inner; ++i) {
    farthest = std::max(farthest, radius(i));
    low = std::min(low, points.y[i]);
    high = std::max(high, points.y[i]);
  }
  constexpr double kBeside = 0.005;  // m: from its borders
  for (std::size_t i = inner; i < points.x.size(); ++i)
    if (points.y[i] > low + kBeside && points.y[i] < high - kBeside) {
      EXPECT_GT(radius(i), farthest) << i;
    }

  EXPECT_THAT(over(path("tube.weft"), {"--body", path("pole.obj")}).err,
              HasSubstr("--body excludes --over"));
  EXPECT_THAT(over(path("pole.obj"), {}).err, HasSubstr("pole.obj: "));
  v1::Scene moving = small_scene();
  v1::Collider& ball = *moving.add_colliders();
  ball.mutable_sphere()->set_radius_m(0.1);
  ball.mutable_sphere()->mutable_center_m()->set_y(-1);
  ball.add_path()->set_time_s(1);
  ASSERT_EQ(run_weft({"record", scene_file(moving), "--to", "1", "-o", path("moving.weft")}).exit,
            0);
  EXPECT_THAT(over(path("moving.weft"), {}).err,
              HasSubstr("moving.weft: \"collider\" moves; what is worn stands still"));
}

TEST_F(Drape, OfAShirtIsGoodAndItsCollarFallsAllAround) {
  const Outcome outcome =
      run_weft({"drape", "shirt", "--edge", "0.025", "--textile", "jersey_interlock", "--recording",
                path("shirt.weft"), "--json"});
  ASSERT_EQ(outcome.exit, 0) << outcome.err;
  EXPECT_EQ(outcome.json()["verdict"]["cloth_cut_count"], 0);
  client::RecordingReader recording(path("shirt.weft"));
  const client::ClothMesh shirt = client::cloth_of(recording)[0];
  const client::Points points =
      client::read_points(recording.read(recording.last_frame()).positions_m(), recording.header());
  const auto particles = [&](const std::string& name) {
    std::set<int> found;
    for (const client::ClothPanel& panel : shirt.panels)
      for (std::size_t t = panel.first; t < panel.first + panel.count; ++t)
        if (panel.name == name)
          for (const auto i : shirt.triangles[t]) found.insert(static_cast<int>(i));
    return found;
  };
  for (const std::string side : {"front", "back"}) {
    const std::set<int> stand = particles("stand-" + side);
    const std::set<int> fall = particles("fall-" + side);
    const auto place = [&](int particle) {
      const auto i = static_cast<std::size_t>(particle);
      return std::array{points.x[i], points.y[i], points.z[i]};
    };
    for (const int i : fall) {
      if (stand.contains(i)) continue;
      // lower than where the collar turns, in the direction from the neck's middle that it lies in
      const auto [x, y, z] = place(i);
      double most = -1, roll = 0;
      for (const int j : fall) {
        const auto [u, v, w] = place(j);
        const double along = (x * u + z * w) / (std::hypot(x, z) * std::hypot(u, w));
        if (stand.contains(j) && along > most) most = along, roll = v;
      }
      EXPECT_LT(y, roll - 0.015) << side << ' ' << i;
    }
  }
}

TEST_F(Drape, OfWhatIsTooWideSlidesDownAndIsNotGood) {
  const Outcome outcome = drape(0.8, {"--seconds", "2"});
  EXPECT_EQ(outcome.exit, 1);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("not a good drape"), HasSubstr("SLID_DOWN")));
  EXPECT_THAT(outcome.out, HasSubstr("verdict   not good"));
}

TEST_F(Drape, SaysWhatIsWrongWithItsStart) {
  const Outcome outcome = drape(0.62, {"--seconds", "0.1"}, 0.05);
  EXPECT_THAT(outcome.out, HasSubstr("start     STARTS_INSIDE: "));
  EXPECT_THAT(drape(0.62, {"--seconds", "0.1", "--deflate", "0.2"}).err,
              HasSubstr("dressing.deflate_m: 0.2 m is not within 0 to 0.1 m"));
}

TEST_F(Drape, OfAScriptIsThatOfTheCommandAndHeldToItsVerdict) {
  ASSERT_EQ(drape(0.62, {"--recording", path("command.weft")}).exit, 0);
  write_file(path("wide.json"), client::pattern_text(tube_pattern(0.8)));
  write_file(path("tubes.yaml"), R"(
for: {tube: [tube, wide]}
parallel: 2
steps:
  - create: {drape: $tube.json, body: pole.obj, edge_m: 0.03, fields: {cloth_contact: true}}
  - record: {file: $tube.weft}
  - run: {until_rest: true, until_time_s: 3}
  - expect: {verdict: good, slid_m: {max: 0.01}, pressure_pa: {min: 1}}
)");
  const Outcome outcome = run_weft({"script", path("tubes.yaml"), "--embedded"});
  EXPECT_EQ(outcome.exit, 1);
  EXPECT_THAT(outcome.err, HasSubstr("1 of 2 cases failed"));
  EXPECT_THAT(outcome.out,
              AllOf(HasSubstr("tube wide: "), HasSubstr("line 8: expect: verdict is "),
                    HasSubstr("SLID_DOWN: "), HasSubstr(", not good"),
                    HasSubstr("line 8: expect: slid_m is "), Not(HasSubstr("tube tube: "))));
  EXPECT_THAT(run_weft({"diff", path("command.weft"), path("tube.weft")}).out,
              HasSubstr("largest    0 m\n"));  // the command's has pressures too
}

TEST_F(Drape, OfAScriptIsCheckedBeforeItRuns) {
  const auto refusal = [&](const std::string& steps) {
    write_file(path("tubes.yaml"), "steps:\n" + steps);
    return run_weft({"script", path("tubes.yaml"), "--embedded", "--dry-run"}).err;
  };
  v1::Pattern torn = tube_pattern(0.62);
  torn.mutable_seams(0)->mutable_first_side(0)->set_panel("sleeve");
  write_file(path("torn.json"), client::pattern_text(torn));
  write_file(path("tube.json"), client::pattern_text(tube_pattern(0.62)));
  write_file(path("pole.obj"), pole_obj());
  EXPECT_THAT(refusal(R"(  - create: {session: a, drape: gown, edge_m: 1, body: none.obj}
  - create: {session: b, drape: tshirt, size: 41, waist_m: 9, rows: 3}
  - create: {session: c, template: hang, deflate_m: 0.01}
  - expect: {session: c, verdict: [SLID]}
  - expect: {session: c, verdict: []}
)"),
              AllOf(HasSubstr("line 2: create.drape "), HasSubstr("one of tshirt, "),
                    HasSubstr("line 2: create.edge_m     1 is not within 0.002 to 0.1"),
                    HasSubstr("line 2: create.body "), HasSubstr("line 3: create.size "),
                    HasSubstr("within 32 to 54, sizes of a woman"),
                    HasSubstr("line 3: create.waist_m    9 is not within 0.45 to 1.8"),
                    HasSubstr("line 3: create.rows       is for a template"),
                    HasSubstr("line 4: create.deflate_m  is for a drape"),
                    HasSubstr("line 5: expect.verdict    \"SLID\" is not good"),
                    HasSubstr("line 6: expect.verdict    give good, or faults")));
  EXPECT_THAT(refusal(R"(  - create: {session: a, drape: torn.json, body: pole.obj, edge_m: 0.03}
  - create: {session: b, drape: tube.json, body: pole.obj, fields: {"sheets[0].skin_m": -3}}
)"),
              AllOf(HasSubstr("line 2: create: seams[0].first_side[0].panel of a "),
                    HasSubstr("\"sleeve\""), HasSubstr("line 3: create: sheets[0].skin_m of b")));
}

TEST_F(Drape, ReplacesAFileOnlyWhenAsked) {
  write_file(path("tube.glb"), "mine");
  EXPECT_EQ(drape(0.62, {"-o", path("tube.glb")}).exit, 4);
  EXPECT_EQ(read_file(path("tube.glb")), "mine");
  EXPECT_EQ(drape(0.62, {"-o", path("tube.png")}).exit, 2);
}

}  // namespace
}  // namespace weft::testing

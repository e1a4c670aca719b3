#include <gmock/gmock.h>

#include <filesystem>
#include <pugixml.hpp>
#include <thread>

#include "client/recording/reader.h"
#include "tests/client/client_test.h"
#include "tests/support/service/assets.h"

namespace weft::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

class ScriptTest : public ClientTest {
 protected:
  ScriptTest() { scene_file(small_scene()); }

  std::string script(const std::string& text) const {
    write_file(path("cloth.yaml"), text);
    return path("cloth.yaml");
  }

  // What a script that is refused is told.
  std::string refusal(const std::string& text) {
    const Outcome refused = weft({"script", "--dry-run", script(text)});
    EXPECT_EQ(refused.exit, 4) << refused.out << refused.err;
    return refused.err;
  }

  // What the command answers that is stopped once a session is beyond frame 3.
  Outcome stopped(const std::vector<std::string>& arguments) {
    std::stop_source stop;
    Outcome outcome;
    std::thread running([&] { outcome = weft(arguments, stop.get_token()); });
    const auto is_running = [&] {
      const auto list = ask({"session", "list"})["sessions"];
      return !list.empty() && list[0]["frame"] > 3;
    };
    while (!is_running()) std::this_thread::yield();
    stop.request_stop();
    running.join();
    return outcome;
  }

  std::size_t sessions() { return ask({"session", "list"})["sessions"].size(); }
};

TEST_F(ScriptTest, DoesItsStepsInOrder) {
  const auto result = ask({"script", script(R"(
steps:
  - create: {scene: scene.json}
  - record: {file: cloth.weft, encoding: float64}
  - run: {until_frame: 20}
  - set: {fields: {bend_n_m2: 3.0e-5}}
  - run: {until_time_s: 0.5}
  - expect: {frame: 30, time_s: {near: 0.5, within: 1.0e-9}, at_rest: false}
)")});
  EXPECT_EQ(result["failed"], 0);
  EXPECT_EQ(result["cases"][0]["steps_done"], 6);
  EXPECT_THAT(result["cases"][0]["expectations"], SizeIs(3));
  EXPECT_EQ(ask({"verify", path("cloth.weft")})["frames"], 31);
  EXPECT_EQ(sessions(), 0) << "they end with their case";
}

// The same by hand, frame for frame.
TEST_F(ScriptTest, RecordsWhatTheCommandsRecord) {
  ask({"script", script(R"(
steps:
  - create: {scene: scene.json}
  - record: {file: script.weft}
  - run: {until_frame: 20}
  - set: {fields: {bend_n_m2: 3.0e-5}}
  - run: {until_frame: 40}
)")});
  ask({"session", "create", path("scene.json"), "--id", "hand"});
  ask({"step", "hand", "--frames", "20"});
  ask({"textile", "set", "hand", "--set", "bend_n_m2=3e-5"});
  ask({"step", "hand", "--frames", "20"});
  ask({"record", "hand", "--from", "0", "--to", "40", "-o", path("hand.weft")});
  EXPECT_EQ(weft({"diff", path("script.weft"), path("hand.weft"), "--within", "0"}).exit, 0);
}

TEST_F(ScriptTest, GrabsDragsAndMovesWhileItRuns) {
  v1::Scene scene = small_scene();
  scene.add_colliders()->mutable_sphere()->set_radius_m(0.01);
  scene_file(scene);
  const std::string text = R"(
variables: {x: 0.25}
steps:
  - create: {scene: scene.json}
  - run: {until_frame: 2}
  - grab: {row: 3, column: 0}
  - drag: {row: 3, column: 0, to_m: [$x, 0, 0.1], over_s: 0.1}
  - pin: {row: 3, column: 4}
  - move: {to_m: [0, -1, 0]}
  - run: {until_frame: 8}
  - expect: {particle: {row: 3, column: 0, x_m: {near: $x, within: 1.0e-6}}}
  - release: {row: 3, column: 0}
  - unpin: {row: 3, column: 4}
  - run: {until_frame: 12}
  - expect: {particle: {row: 3, column: 0, x_m: {max: 0.249}}}
)";
  EXPECT_EQ(ask({"script", script(text)})["failed"], 0);
  const std::string told = refusal(R"(steps:
  - create: {scene: scene.json}
  - grab: {row: 4, column: 0}
  - drag: {row: 1, column: 0, to_m: [1, 2, 3]}
  - move: {collider: moon, to_m: [1, 2, 3]}
)");
  EXPECT_THAT(told, AllOf(HasSubstr("line 3: grab"), HasSubstr("not on a sheet of 4 x 5"),
                          HasSubstr("line 4: drag"), HasSubstr("was not grabbed before this"),
                          HasSubstr("line 5: move"), HasSubstr("there is no collider \"moon\"")));
  EXPECT_THAT(
      refusal("steps:\n  - create: {scene: scene.json}\n  - drag: {row: 0, to_m: [1, 2]}\n"),
      AllOf(HasSubstr("column is missing"), HasSubstr("drag.to_m")));
}

TEST_F(ScriptTest, LeadsABodyThroughItsPoses) {
  scene_file(posed_scene());
  EXPECT_EQ(ask({"script", script(R"(
steps:
  - create: {scene: scene.json}
  - record: {file: led.weft}
  - pose: {to_s: 10.5, speed_m_per_s: 2}
  - run: {until_frame: 12}
)")})["failed"],
            0);
  const auto times = client::RecordingReader(path("led.weft")).read(12).stats().pose_times_s();
  ASSERT_THAT(times, SizeIs(1));
  EXPECT_EQ(times[0], 10.5);
  EXPECT_THAT(refusal(R"(steps:
  - create: {scene: scene.json}
  - pose: {speed_m_per_s: 21}
)"),
              AllOf(HasSubstr("to_s is missing"), HasSubstr("speed_m_per_s")));
}

// Only what has relaxed stands still to the last bit.
TEST_F(ScriptTest, RelaxesAsTheCommandsDo) {
  const auto result = ask({"script", script(R"(
steps:
  - create: {scene: scene.json}
  - relax: {}
  - run: {until_rest: true}
  - expect: {at_rest: true, kinetic_energy_j: {max: 0}}
)")});
  EXPECT_EQ(result["failed"], 0);
  ask({"session", "create", path("scene.json"), "--id", "hand"});
  const std::vector<std::string> record = {"record",  "hand", "--until-rest",
                                           "--relax", "-o",   path("hand.weft")};
  EXPECT_THAT(weft(record).err, HasSubstr("--relax is for a session that runs; give --run"));
  std::vector<std::string> runs = record;
  runs.push_back("--run");
  EXPECT_LE(ask(runs)["residual"], 1e-3);
}

TEST_F(ScriptTest, ParticlesOfTrianglesGoByTheirNumber) {
  scene_file(scene_of(square_mesh(4)));
  EXPECT_EQ(ask({"script", script(R"(
steps:
  - create: {scene: scene.json}
  - grab: {number: 24}
  - drag: {number: 24, to_m: [0.3, 0, 0.1], over_s: 0.1}
  - run: {until_frame: 8}
  - expect: {particle: {number: 24, x_m: {near: 0.3, within: 1.0e-6}}}
  - release: {number: 24}
)")})["failed"],
            0);
  EXPECT_THAT(refusal("steps:\n  - create: {scene: scene.json}\n  - grab: {row: 1, column: 2}\n"),
              AllOf(HasSubstr("line 3: grab"), HasSubstr("give a particle's number, not 1,2")));
  EXPECT_THAT(refusal("steps:\n  - create: {scene: scene.json}\n  - grab: {number: 3, row: 1}\n"),
              HasSubstr("line 3: grab.row: is given beside number"));
  scene_file(small_scene());
  EXPECT_THAT(refusal(R"(steps:
  - create: {scene: scene.json}
  - grab: {number: 19}
  - release: {row: 3, column: 4}
  - pin: {number: 20}
  - expect: {particle: {number: 20, x_m: 1}}
)"),
              AllOf(Not(HasSubstr("line 4")), HasSubstr("particle 20 is not on a sheet of 20"),
                    HasSubstr("line 5: pin"), HasSubstr("line 6: expect.particle")));
}

TEST_F(ScriptTest, ATextileChangesOverTime) {
  EXPECT_EQ(ask({"script", script(R"(steps:
  - create: {template: paper-1, rows: 7, columns: 7}
  - set: {fields: {stretch_n_per_m: 200}, over_s: 2}
  - run: {until_time_s: 1}
  - expect: {strain: {max: 0.003}}
  - run: {until_time_s: 4}
  - expect: {strain: {min: 0.004}}
)")})["failed"],
            0);
  EXPECT_THAT(refusal(R"(steps:
  - create: {template: paper-1}
  - set: {preset: denim_11oz, over_s: 0.5}
)"),
              HasSubstr("line 3: set.over_s: leads from raw to raw"));
}

TEST_F(ScriptTest, EveryCombinationOfALoopIsACase) {
  const auto result = ask({"script", script(R"(
variables: {last: 3}
for: {k_b: [0, 0.2], segments: [5, 32]}
parallel: 3
steps:
  - create: {template: paper-3, rows: 5, columns: 5, bend: $k_b, segments: $segments}
  - record: {file: "out-$case.weft"}
  - run: {until_frame: $last}
  - expect: {frame: $(last)}
)"),
                           "--set", "last=4"});
  EXPECT_EQ(result["failed"], 0);
  ASSERT_THAT(result["cases"], SizeIs(4));
  EXPECT_EQ(result["cases"][1]["name"], "k_b 0, segments 32");
  const client::RecordingReader recording(path("out-k_b-0.2-segments-5.weft"));
  EXPECT_EQ(recording.last_frame(), 4);
  EXPECT_EQ(recording.scene().sheets(0).bending().choi_ko().segments(), 5);
  EXPECT_DOUBLE_EQ(recording.scene().sheets(0).textile().raw().bend_n_m2(), 0.2e-4);
}

TEST_F(ScriptTest, ATextileMayBeAFileBesideTheScript) {
  write_file(path("mine.json"),
             R"({"values": {"areal_density_kg_per_m2": 0.2, "tensile_warp_n_per_m": 300,
                 "tensile_weft_n_per_m": 200, "shear_n_per_m": 30, "bend_rigidity_warp_n_m": 1e-6,
                 "bend_rigidity_weft_n_m": 1e-6}})");
  const auto result = ask({"script", script(R"(
steps:
  - create: {template: hang, rows: 4, columns: 4, textile: mine.json}
  - set: {textile: mine.json}
  - set: {textile: denim_11oz}
  - record: {file: own.weft}
  - run: {until_frame: 3}
)")});
  EXPECT_EQ(result["failed"], 0);
  const client::RecordingReader recording(path("own.weft"));
  EXPECT_EQ(recording.scene().sheets(0).textile().measured().shear_n_per_m(), 30);
}

TEST_F(ScriptTest, AnInnerLoopRepeatsStepsOnTheSameSession) {
  const auto result = ask({"script", script(R"(
steps:
  - create: {scene: scene.json, fields: {"sheets[0].grid.columns": 6}}
  - for: {k_b: [1.0e-5, 2.0e-5], last: [3]}
    steps:
      - set: {fields: {bend_n_m2: $k_b}}
      - for: {frames: ["1$last", "2$last"]}
        steps:
          - expect: {largest_strain: {min: 0}}
  - run: {until_frame: 13}
  - expect: {particle: {row: 0, column: 5, x_m: {min: 0}}}
)")});
  EXPECT_EQ(result["failed"], 0);
  EXPECT_EQ(result["cases"][0]["steps"], 9);
}

TEST_F(ScriptTest, SessionsRunSideBySide) {
  const auto result = ask({"script", script(R"(
steps:
  - create: {session: a, scene: scene.json}
  - create: {session: b, scene: scene.json}
  - run: {session: a, wait: false}
  - wait: {session: a, frame: 15}
  - run: {session: b, until_frame: 15}
  - pause: {session: a}
  - expect: {session: a, frame: {min: 15}}
  - expect: {session: b, frame: 15}
  - create: {session: c, scene: scene.json}
  - run: {session: [b, c], until_frame: 40}
  - expect: {session: c, frame: 40}
)")});
  EXPECT_EQ(result["failed"], 0) << result;
}

TEST_F(ScriptTest, SessionsGoOnFromASnapshotAsOftenAsWanted) {
  const auto result = ask({"script", script(R"(
steps:
  - create: {scene: scene.json}
  - grab: {row: 3, column: 0}
  - run: {until_frame: 10}
  - snapshot: {snapshot: early}
  - record: {file: cloth.weft}
  - run: {until_frame: 15}
  - restore: {session: same, snapshot: early}
  - expect: {session: same, frame: 10}
  - restore: {session: limp, snapshot: early}
  - release: {session: limp, row: 3, column: 0}
  - for: {session: [same, limp]}
    steps:
      - record: {session: $session, file: $session.weft}
  - run: {session: [cloth, same, limp], until_frame: 30}
)")});
  EXPECT_EQ(result["failed"], 0) << result;
  const auto against_cloth = [&](const std::string& file) {
    return weft({"diff", path("cloth.weft"), path(file), "--within", "0"});
  };
  EXPECT_EQ(against_cloth("same.weft").exit, 0) << against_cloth("same.weft").err;
  EXPECT_EQ(against_cloth("limp.weft").exit, 1);
  EXPECT_EQ(ask({"info", path("same.weft")})["first_frame"], 10);
  EXPECT_EQ(sessions(), 0);
}

TEST_F(ScriptTest, SnapshotsAreHeldToWhatAServerKeeps) {
  const std::string told = refusal(R"(steps:
  - create: {scene: scene.json}
  - snapshot: {snapshot: a}
  - snapshot: {snapshot: a}
  - snapshot: {session: cloth}
  - restore: {snapshot: a}
  - restore: {session: cloth, snapshot: a}
  - restore: {session: b, snapshot: z}
  - restore: {session: c}
)");
  EXPECT_THAT(told,
              AllOf(HasSubstr("line 4: snapshot.snapshot  there is a snapshot \"a\" already"),
                    HasSubstr("line 5: snapshot           snapshot is missing"),
                    HasSubstr("line 6: restore            session is missing"),
                    HasSubstr("line 7: restore.session    there is a session \"cloth\" already"),
                    HasSubstr("no snapshot \"z\" was taken before this"),
                    HasSubstr("line 9: restore            snapshot is missing")));
  std::string many = "steps:\n  - create: {scene: scene.json}\n";
  for (int i = 0; i < 17; ++i) many += "  - snapshot: {snapshot: s" + std::to_string(i) + "}\n";
  EXPECT_THAT(refusal(many), HasSubstr("line 19: snapshot: a session keeps at most 16 snapshots"));
}

TEST_F(ScriptTest, WhatIsNotAsExpectedFailsItsCaseAndIsAllTold) {
  const Outcome failed = weft({"script", "--junit", path("junit.xml"), script(R"(name: "a <test>"
for: {low: [-1000, 1000]}
steps:
  - create: {scene: scene.json}
  - run: {until_frame: 5}
  - expect:
      at_rest: false
      energy_j: {min: $low}
      frame: {max: 9}
      rest_time_s: {max: 3}
  - expect: {frame: 5}
)")});
  EXPECT_EQ(failed.exit, 1);
  EXPECT_THAT(failed.err, HasSubstr("2 of 2 cases failed"));
  EXPECT_THAT(failed.out, AllOf(HasSubstr("line 6: expect: energy_j is "),
                                HasSubstr(", below 1000"), HasSubstr("rest_time_s: there is none"),
                                HasSubstr("4 of 4"), Not(HasSubstr("below -1000"))));

  pugi::xml_document junit;
  ASSERT_TRUE(junit.load_file(path("junit.xml").c_str()));
  const auto suite = junit.child("testsuite");
  EXPECT_STREQ(suite.attribute("name").value(), "a <test>");
  EXPECT_EQ(suite.attribute("tests").as_int(), 2);
  EXPECT_EQ(suite.attribute("failures").as_int(), 2);
  EXPECT_STREQ(suite.child("testcase").attribute("name").value(), "low -1000");
  EXPECT_THAT(suite.child("testcase").child("failure").attribute("message").value(),
              HasSubstr("rest_time_s"));
}

TEST_F(ScriptTest, AStepThatFailsEndsItsCaseAlone) {
  scene_file(diverging_scene(), "wild.json");
  const Outcome failed = weft({"script", "--json", script(R"(
for: {scene: [wild, scene]}
steps:
  - create: {scene: $scene.json}
  - run: {until_frame: 200}
  - expect: {frame: 200}
)")});
  EXPECT_EQ(failed.exit, 1);
  const auto cases = failed.json()["cases"];
  EXPECT_EQ(cases[0]["passed"], false);
  EXPECT_EQ(cases[0]["steps_done"], 1);
  EXPECT_EQ(cases[0]["failures"][0]["line"], 5);
  EXPECT_EQ(cases[1]["passed"], true);
  EXPECT_EQ(sessions(), 0);
}

TEST_F(ScriptTest, SaysAllThatIsWrongWithFileLineAndField) {
  const std::string text = refusal(R"(parallel: 0
for: {rows: [3, 1]}
steps:
  - create: {template: moon}
  - create: {session: b, template: hang, rows: $rows, colums: 3}
  - run: {session: c, until_frame: soon}
  - run: {session: b}
  - fly: {away: true}
  - expect: {session: b, frame: {near: 3}}
  - record: {session: b, file: $nothing.weft, file: x.weft}
  - set: {session: b, preset: denim_11oz, fields: {bend_n_m2: 1}}
)");
  const std::string file = path("cloth.yaml");
  for (const std::string fault : {
           ", line 1: parallel ",
           ", line 4: create.template ",
           ", line 5: create.colums ",
           ", line 6: run.session ",
           ", line 6: run.until_frame ",
           ", line 7: run ",
           ", line 8: fly ",
           ", line 9: expect.frame ",
           ", line 10: record.file ",
           ", line 11: set ",
       }) {
    EXPECT_THAT(text, HasSubstr(file + fault));
  }
  EXPECT_THAT(text, AllOf(HasSubstr("there is no variable $nothing"), HasSubstr("given twice"),
                          HasSubstr("rows and columns are 2 to 4096"), HasSubstr("create, set")));
}

TEST_F(ScriptTest, AsksTheServerBeforeItRunsAnything) {
  const std::string text = refusal(R"(for: {bend: [1.0e-5, -1]}
steps:
  - create: {scene: scene.json, fields: {"sheets[0].grid.spacing_m": -0.5}}
  - create: {session: b, scene: scene.json}
  - set: {session: b, fields: {bend_n_m2: $bend}}
  - set: {session: b, sheet: sail, fields: {weight: 1}}
  - expect: {session: b, particle: {row: 9, column: 0, x_m: 1}}
  - record: {session: b, file: no/such/cloth.weft}
  - record: {session: b, file: scene.json}
)");
  EXPECT_THAT(text, AllOf(HasSubstr("line 3: create: sheets[0].grid.spacing_m of cloth"),
                          HasSubstr("line 5: set: sheets[0].textile.raw.bend_n_m2 of b"),
                          HasSubstr("line 6: set"), HasSubstr("line 7: expect.particle"),
                          HasSubstr("line 8: record.file"), HasSubstr("exists; --force"),
                          HasSubstr("written more than once")));
  EXPECT_EQ(sessions(), 0);
}

TEST_F(ScriptTest, YamlThatIsNoneIsReportedWithItsLine) {
  EXPECT_THAT(refusal("steps:\n  - create: {scene: [}\n"), HasSubstr("cloth.yaml, line 2"));
  EXPECT_THAT(refusal("[]"), HasSubstr("fields are wanted"));
  EXPECT_THAT(refusal(""), HasSubstr("steps are missing"));
  EXPECT_THAT(refusal("steps: 3"), HasSubstr("a list of steps"));
  EXPECT_EQ(weft({"script", path("missing.yaml")}).exit, 4);
  EXPECT_EQ(weft({"script", script("steps: []"), "--set", "size=3"}).exit, 2);
}

TEST_F(ScriptTest, ADryRunRunsNothing) {
  const auto plan = ask({"script", "--dry-run", script(R"(
for: {last: [1, 2]}
steps:
  - create: {scene: scene.json}
  - record: {file: "$case.weft"}
  - run: {until_frame: $last}
)")});
  EXPECT_THAT(plan["cases"], SizeIs(2));
  EXPECT_EQ(plan["cases"][0]["steps"], (nlohmann::json{"create", "record", "run"}));
  EXPECT_FALSE(std::filesystem::exists(path("last-1.weft")));
}

TEST_F(ScriptTest, NeedsNoServerWhereItIsEmbedded) {
  const Outcome outcome = run_weft({"script", "--embedded", script(R"(
steps:
  - create: {template: hang, rows: 5, columns: 5}
  - run: {until_frame: 3}
)")});
  EXPECT_EQ(outcome.exit, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("passed"));
}

TEST_F(ScriptTest, AStopEndsItAndItsSessions) {
  const std::string file = script(R"(
steps:
  - create: {scene: scene.json}
  - record: {file: cloth.weft}
  - run: {until_frame: 900000000}
)");
  const Outcome outcome = stopped({"script", file});
  EXPECT_EQ(outcome.exit, 130);
  EXPECT_EQ(sessions(), 0);
  EXPECT_EQ(weft({"verify", path("cloth.weft")}).exit, 0);
}

TEST_F(ScriptTest, AStopStillTellsOfTheCasesThatAreOver) {
  const std::string file = script(R"(
for: {last: [2, 900000000, 3]}
steps:
  - create: {scene: scene.json}
  - run: {until_frame: $last}
)");
  const Outcome outcome = stopped({"script", file, "--junit", path("cloth.xml"), "--json"});
  EXPECT_EQ(outcome.exit, 130);
  const auto cases = nlohmann::json::parse(outcome.out)["cases"];
  EXPECT_TRUE(cases[0]["passed"]);
  EXPECT_TRUE(cases[1]["interrupted"]);
  EXPECT_EQ(cases[1]["steps_done"], 1);
  EXPECT_TRUE(cases[2]["interrupted"]);
  EXPECT_EQ(cases[2]["steps_done"], 0);
  const std::string junit = read_file(path("cloth.xml"));
  EXPECT_THAT(junit, HasSubstr("failures=\"0\""));
  EXPECT_THAT(junit, HasSubstr("<skipped message=\"interrupted\""));
}

}  // namespace
}  // namespace weft::testing

#include <gmock/gmock.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <thread>

#include "client/connection.h"
#include "client/templates/templates.h"
#include "client/weft.h"
#include "server/config.h"
#include "tests/client/client_test.h"
#include "tests/support/service/assets.h"

namespace weft::testing {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Le;
using ::testing::Not;
using ::testing::SizeIs;

using CommandsTest = ClientTest;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// Lines that are one JSON object each, by protobuf's own parser.
std::vector<google::protobuf::Struct> json_lines(const std::string& text) {
  std::vector<google::protobuf::Struct> objects;
  for (const std::string& line : lines_of(text)) {
    const auto status = google::protobuf::util::JsonStringToMessage(line, &objects.emplace_back());
    EXPECT_TRUE(status.ok()) << status.ToString() << " in " << line;
  }
  return objects;
}

TEST_F(CommandsTest, ASceneGoesFromTemplateThroughSessionAndRecordingToAnExport) {
  const std::string scene = path("scene.json");
  const std::string recording = path("drape.weft");
  ask({"scene", "new", "--template", "sphere", "--rows", "7", "--columns", "9", "-o", scene});
  EXPECT_GT(ask({"scene", "check", scene})["linear_bound_s"].get<double>(), 0);
  EXPECT_EQ(ask({"session", "create", scene, "--id", "drape"})["name"], "sessions/drape");

  const auto stepped = ask({"step", "drape", "--frames", "12"});
  EXPECT_EQ(stepped["frame"], 12);
  EXPECT_EQ(stepped["applied_frame"], 1);

  const auto recorded = ask({"record", "drape", "--from", "0", "--to", "12", "-o", recording});
  EXPECT_EQ(recorded["frames"], 13);
  EXPECT_EQ(recorded["complete"], true);
  const auto info = ask({"info", recording});
  EXPECT_EQ(info["frames"], 13);
  EXPECT_EQ(info["header"]["sheets"][0]["columns"], 9);
  EXPECT_EQ(info["faults"], 0);

  const auto exported = ask({"export", recording, "--format", "csv", "-o", path("drape.csv")});
  EXPECT_EQ(exported["frames"], 13);
  EXPECT_EQ(exported["particles"], 63);
  EXPECT_EQ(ask({"session", "snapshot", "drape"})["name"], "sessions/drape/snapshots/frame-12");
  EXPECT_EQ(ask({"session", "snapshots", "drape"})["snapshots"].size(), 1);
  EXPECT_EQ(ask({"session", "restore", "drape", "frame-12", "--id", "again"})["name"],
            "sessions/again");
  ask({"session", "delete", "again"});
  EXPECT_EQ(ask({"session", "delete", "drape"})["deleted"], "sessions/drape");
  EXPECT_TRUE(ask({"session", "list"})["sessions"].empty());
}

TEST(SessionList, SaysWhereASessionIsThatTheServerHasNot) {
  const TemporaryDirectory directory;
  ServerOptions options;
  options.data_dir = directory.name();
  options.idle = std::chrono::milliseconds(50);
  Service service(options);
  service.step(service.create(small_scene(), "curtain"), 3);
  while (service.info().sessions() > 0) std::this_thread::yield();
  const Outcome listed = run_weft({"--server", service.server.address(), "session", "list"});
  EXPECT_THAT(listed.out, HasSubstr("sessions/curtain  stored  -  "));
  const Outcome shown =
      run_weft({"--server", service.server.address(), "session", "get", "curtain"});
  EXPECT_EQ(shown.exit, 0) << shown.err;
}

TEST_F(CommandsTest, ASceneIsPricedByThePaceOfTheServersSessions) {
  const std::string scene = scene_file(small_scene());
  EXPECT_THAT(weft({"scene", "explain", scene}).out, Not(HasSubstr("of a core")));
  const auto session = service_.create(client::make_template("load", {}));  // never asleep
  v1::ServerStats stats;
  do {
    service_.step(session, 100);
    grpc::ClientContext another;
    ASSERT_TRUE(service_.servers->GetServerStats(&another, {}, &stats).ok());
  } while (stats.frame_time_s().sum() < 0.1);
  EXPECT_THAT(weft({"scene", "explain", scene}).out,
              HasSubstr("of a core, at the pace of this server's sessions"));
}

TEST_F(CommandsTest, ASceneFileIsRefusedWithEveryBadFieldAndItsPlaceInTheFile) {
  v1::Scene scene = small_scene();
  scene.mutable_sheets(0)->mutable_grid()->set_rows(1);
  scene.mutable_sheets(0)->mutable_grid()->set_spacing_m(-0.5);
  const std::string file = scene_file(scene);
  for (const std::string command : {"check", "create"}) {
    const Outcome refused = weft({command == "check" ? "scene" : "session", command, file});
    EXPECT_EQ(refused.exit, 1);
    EXPECT_THAT(refused.err, AllOf(HasSubstr("  sheets[0].grid.rows "), HasSubstr("-0.5"),
                                   HasSubstr("  sheets[0].grid.spacing_m ")));
  }
  const auto error = nlohmann::json::parse(weft({"scene", "check", file, "--json"}).err)["error"];
  EXPECT_EQ(error["code"], "INVALID_ARGUMENT");
  EXPECT_EQ(error["reason"], "FIELD_INVALID");
  EXPECT_THAT(error["violations"], SizeIs(2));
  EXPECT_EQ(error["violations"][0]["field"], "sheets[0].grid.rows");
}

TEST_F(CommandsTest, ACornerIsGrabbedDraggedAndReleased) {
  ask({"session", "create", scene_file(small_scene()), "--id", "cloth"});
  EXPECT_EQ(ask({"act", "grab", "cloth", "3,4", "--to", "-0.1,0.2,0.3", "--over", "0.1"}),
            nlohmann::json({{"applied_frame", 1}}));
  ask({"step", "cloth", "--frames", "7"});
  ask({"record", "cloth", "--from", "7", "--to", "7", "-o", path("cloth.weft")});
  ask({"export", path("cloth.weft"), "--format", "csv", "-o", path("cloth.csv")});
  EXPECT_THAT(read_file(path("cloth.csv")),
              HasSubstr(",-0.100000001490,0.200000002980,0.300000011921"));
  EXPECT_EQ(weft({"act", "release", "cloth", "sheet:3,4"}).out, "applied from frame 8\n");
  EXPECT_THAT(weft({"act", "release", "cloth", "3,4"}).err,
              HasSubstr("actions[0].release.particle: 19 is not grabbed"));
  EXPECT_THAT(weft({"act", "pin", "cloth", "4,4"}).err,
              HasSubstr("row 4, column 4 is not on a sheet of 4 x 5 particles"));
  EXPECT_THAT(weft({"act", "pin", "cloth", "4,"}).err,
              HasSubstr("4,: write ROW,COLUMN or NUMBER, after SHEET:"));
  EXPECT_EQ(weft({"act", "pin", "cloth", "sheet:19"}).out, "applied from frame 8\n");
  EXPECT_THAT(weft({"act", "pin", "cloth", "20"}).err,
              HasSubstr("particle 20 is not on a sheet of 20 particles"));
  EXPECT_THAT(weft({"act", "move", "cloth", "--to", "0,1,0"}).err,
              HasSubstr("the scene has no collider"));
}

TEST_F(CommandsTest, ABodyIsLedThroughItsPosesAtASpeed) {
  ask({"session", "create", scene_file(posed_scene()), "--id", "lid"});
  EXPECT_EQ(weft({"act", "pose", "lid", "--to", "10.5", "--speed", "2"}).out,
            "applied from frame 1\n");
  // 0.1 m at 2 m/s, in frames of 1/60 s
  ask({"step", "lid", "--frames", "2"});
  const auto pose_time = [&](std::int64_t frame) {
    return stream("sessions/lid", frame, frame)[0].stats().pose_times_s(0);
  };
  EXPECT_NEAR(pose_time(2), 10 + 2 * 2 / 60.0 / 0.2, 1e-6);
  ask({"step", "lid", "--frames", "10"});
  EXPECT_EQ(pose_time(12), 10.5);
  EXPECT_THAT(weft({"act", "pose", "lid", "--to", "12"}).err,
              HasSubstr("pose_time_s: 12 s is not within its poses, 10 to 11 s"));
  EXPECT_THAT(weft({"act", "pose", "lid", "--to", "11", "--speed", "21"}).err,
              HasSubstr("speed_m_per_s: 21 m/s is not within 0.01 to 20 m/s"));
  EXPECT_THAT(weft({"act", "pose", "lid", "moon", "--to", "11"}).err,
              HasSubstr("there is no collider \"moon\""));
}

TEST_F(CommandsTest, AStepAboveTheBoundIsRefusedWithBoth) {
  v1::Scene scene = small_scene();
  scene.mutable_solver()->set_substep_s(0.01);
  const Outcome refused = weft({"scene", "check", scene_file(scene), "--json"});
  EXPECT_EQ(refused.exit, 1);
  EXPECT_EQ(nlohmann::json::parse(refused.err)["error"]["reason"], "STEP_UNSTABLE");
  EXPECT_THAT(refused.err,
              AllOf(HasSubstr("0.00833"), HasSubstr("0.00116"), HasSubstr("solver.substep_s")));
}

TEST_F(CommandsTest, AnUnknownFieldIsNamedWithFileAndLine) {
  write_file(path("scene.json"), "{\n \"sheets\": [{\n  \"grid\": {\"rowz\": 3}\n }]\n}\n");
  const Outcome refused = weft({"scene", "check", path("scene.json")});
  EXPECT_EQ(refused.exit, 4);
  EXPECT_EQ(refused.err,
            "weft: " + path("scene.json") + ", line 3: no such field: sheets[0].grid.rowz\n");
}

TEST_F(CommandsTest, JsonThatIsNoneIsReportedWithItsLine) {
  write_file(path("scene.json"), "{\n \"sheets\": [\n  {,}\n ]\n}\n");
  const Outcome refused = weft({"session", "create", path("scene.json")});
  EXPECT_EQ(refused.exit, 4);
  EXPECT_THAT(refused.err, HasSubstr("scene.json: line 3, column 4"));
}

TEST_F(CommandsTest, EveryKindOfFailureHasItsExitCode) {
  EXPECT_EQ(weft({"session", "get", "nobody"}).exit, 1);
  EXPECT_EQ(weft({}).exit, 2);
  EXPECT_EQ(weft({"step"}).exit, 2);
  EXPECT_EQ(weft({"fly", "away"}).exit, 2);
  EXPECT_EQ(weft({"scene", "new", "--template", "moon"}).exit, 2);
  EXPECT_EQ(weft({"scene", "check", path("missing.json")}).exit, 4);
  EXPECT_EQ(weft({"info", path("missing.weft")}).exit, 4);
  EXPECT_EQ(weft({"info", scene_file(small_scene())}).exit, 4);

  service_.server.stop();
  const Outcome lost = weft({"session", "list"});
  EXPECT_EQ(lost.exit, 3);
  EXPECT_THAT(lost.err, AllOf(HasSubstr(address_), HasSubstr("--server")));
}

TEST_F(CommandsTest, HealthSaysWhetherTheServerTakesCalls) {
  EXPECT_EQ(weft({"health"}).out, "SERVING\n");
  EXPECT_EQ(ask({"health"})["status"], "SERVING");
  service_.server.stop();
  EXPECT_EQ(weft({"health"}).exit, 3);
}

TEST_F(CommandsTest, TopShowsTheServerAndItsSessions) {
  ask({"session", "create", scene_file(small_scene()), "--id", "drape"});
  ask({"step", "drape", "--frames", "5"});
  const auto look = ask({"top", "--looks", "1", "--interval", "0.05"});
  EXPECT_EQ(look["sessions"][0]["name"], "sessions/drape");
  EXPECT_EQ(look["stats"]["frames"], 5);
  const std::string text = weft({"top", "--looks", "1", "--interval", "0.05"}).out;
  EXPECT_THAT(text, HasSubstr("1 paused"));
  EXPECT_THAT(text, HasSubstr("sessions/drape"));
}

TEST_F(CommandsTest, ASceneFileIsReplacedOnlyWhereAskedTo) {
  const std::vector<std::string> make = {"scene", "new", "--template",
                                         "hang",  "-o",  path("hang.json")};
  EXPECT_EQ(run_weft(make).exit, 0);
  const Outcome again = run_weft(make);
  EXPECT_EQ(again.exit, 4);
  EXPECT_THAT(again.err, ::testing::HasSubstr("--force"));
  auto forced = make;
  forced.emplace_back("--force");
  EXPECT_EQ(run_weft(forced).exit, 0);
}

TEST_F(CommandsTest, AValueOfANewSceneIsSetByItsPlace) {
  const auto make = [](const std::string& setting) {
    return run_weft({"scene", "new", "--template", "sphere", "--set", setting, "--set",
                     "sheets[0].pins[0].particles[0]=3"});
  };
  const auto scene = make("sheets[0].textile.damping_ratio=0.01").json();
  EXPECT_EQ(scene["sheets"][0]["textile"]["damping_ratio"], 0.01);
  EXPECT_FALSE(scene["sheets"][0]["textile"].contains("damping_kg_per_s")) << "one of both";
  EXPECT_EQ(scene["sheets"][0]["pins"][0]["particles"][0], 3);
  EXPECT_EQ(make("solver.integrator=INTEGRATOR_RK4").json()["solver"]["integrator"],
            "INTEGRATOR_RK4");

  const auto refusal = [&](const std::string& setting) {
    const Outcome refused = make(setting);
    EXPECT_EQ(refused.exit, 2);
    return refused.err;
  };
  EXPECT_THAT(refusal("solver.safty=1"), HasSubstr("no such field: safty; SolverSettings has"));
  EXPECT_THAT(refusal("solver.safety=high"), HasSubstr("\"high\" is not a number"));
  EXPECT_THAT(refusal("solver.integrator=RK4"), HasSubstr("INTEGRATOR_RK4"));
  EXPECT_THAT(refusal("sheets.name=a"), HasSubstr("sheets[0]"));
  EXPECT_THAT(refusal("sheets[7].name=a"), HasSubstr("sheets has 1 elements"));
  EXPECT_THAT(refusal("solver.safety"), HasSubstr("FIELD=VALUE"));
}

TEST_F(CommandsTest, ATextileOfOnesOwnIsAFileThatIsTakenWhereAPresetIs) {
  const std::string file = path("mine.json");
  const std::vector<std::string> make = {"textile",
                                         "new",
                                         "-o",
                                         file,
                                         "--areal-density",
                                         "0.19",
                                         "--tensile-warp",
                                         "900",
                                         "--shear",
                                         "30",
                                         "--bend-warp",
                                         "7e-6",
                                         "--bend-weft",
                                         "5e-6",
                                         "--source",
                                         "FAST, lab report 12"};
  const Outcome incomplete = run_weft(make);
  EXPECT_EQ(incomplete.exit, 2);
  EXPECT_THAT(incomplete.err, HasSubstr("give --tensile-weft; or --from"));
  auto complete = make;
  complete.insert(complete.end(), {"--tensile-weft", "700"});
  ASSERT_EQ(run_weft(complete).exit, 0) << run_weft(complete).err;
  EXPECT_EQ(run_weft(complete).exit, 4) << "it is there";
  EXPECT_THAT(run_weft({"textile", "show", file}).out,
              AllOf(HasSubstr("FAST, lab report 12"), HasSubstr("areal_density_kg_per_m2")));

  ask({"scene", "new", "--template", "hang", "--textile", file, "-o", path("hang.json")});
  ask({"session", "create", path("hang.json"), "--id", "hang"});
  const auto measured = [&] {
    return ask({"session", "get", "hang"})["scene"]["sheets"][0]["textile"]["measured"];
  };
  EXPECT_EQ(measured()["tensile_weft_n_per_m"], 700);
  ask({"textile", "set", "hang", "--textile", "denim_11oz"});
  EXPECT_NE(measured()["tensile_weft_n_per_m"], 700);
  ask({"textile", "set", "hang", "--textile", file});
  EXPECT_EQ(measured()["tensile_weft_n_per_m"], 700);
  const auto tested = ask({"lab", "shear", "--isometric", "--textile", file});
  EXPECT_EQ(tested["values"][0]["asked"], 30);
}

TEST_F(CommandsTest, ASceneWithARefusedWarningIsAnError) {
  const std::string scene = path("scene.json");
  ASSERT_EQ(weft({"scene", "new", "--template", "sphere", "-o", scene}).exit, 0);
  EXPECT_EQ(weft({"scene", "check", scene, "--refuse", "STARTS_INSIDE"}).exit, 0);
  for (const std::string command : {"check", "create"}) {
    const Outcome refused = weft({command == "check" ? "scene" : "session", command, scene,
                                  "--refuse", "STARTS_INSIDE,NO_SELF_COLLISION"});
    EXPECT_EQ(refused.exit, 1) << command;
    EXPECT_THAT(refused.err, HasSubstr("NO_SELF_COLLISION, which is refused")) << command;
  }
}

TEST_F(CommandsTest, ATextileMayBeginWithAnotherAndItsValuesAreChecked) {
  const std::string file = path("denser.json");
  ASSERT_EQ(
      run_weft({"textile", "new", "-o", file, "--from", "wool_tropical", "--areal-density", "0.4"})
          .exit,
      0);
  const auto own = ask({"textile", "show", file});
  const auto wool = ask({"textile", "show", "wool_tropical"});
  EXPECT_EQ(own["values"]["areal_density_kg_per_m2"], 0.4);
  EXPECT_EQ(own["values"]["shear_n_per_m"], wool["values"]["shear_n_per_m"]);
  EXPECT_THAT(own["note"].get<std::string>(),
              HasSubstr("wool_tropical with values of its own: areal_density_kg_per_m2."));
  EXPECT_THAT(run_weft({"scene", "check", file}).err, HasSubstr("is a textile, not a scene"));
  const Outcome refused = run_weft({"textile", "new", "-o", path("bad.json"), "--from",
                                    "wool_tropical", "--areal-density", "-1"});
  EXPECT_EQ(refused.exit, 1);
  EXPECT_THAT(refused.err,
              HasSubstr("--areal-density: -1 kg/m^2 is not within 1e-04 to 100 kg/m^2"));
  EXPECT_FALSE(std::filesystem::exists(path("bad.json")));
}

TEST_F(CommandsTest, AMeshTakenForASceneIsToldApart) {
  write_file(path("shirt.obj"), "v 0 0 0\n");
  const Outcome refused = weft({"scene", "check", path("shirt.obj")});
  EXPECT_EQ(refused.exit, 4);
  EXPECT_THAT(refused.err, HasSubstr("is a mesh, not a scene file"));
}

TEST_F(CommandsTest, WhereNoServerIsNamedAFileNeedsNone) {
  const std::string scene = scene_file(small_scene());
  EXPECT_EQ(run_weft({"scene", "check", scene}).exit, 0);
  EXPECT_EQ(run_weft({"textile", "show", "denim_11oz"}).exit, 0);
  const Outcome stepped = run_weft({"step", scene, "--frames", "2"});
  EXPECT_EQ(stepped.exit, 0) << stepped.err;
  EXPECT_THAT(stepped.err, ::testing::HasSubstr("no --server was named"));
  const Outcome named = run_weft({"step", scene, "--server", "127.0.0.1:1"});
  EXPECT_NE(named.exit, 0) << "a server that is named is meant";
}

TEST_F(CommandsTest, HelpIsAnAnswer) {
  const Outcome help = weft({"--help"});
  EXPECT_EQ(help.exit, 0);
  EXPECT_THAT(help.out, AllOf(HasSubstr("\n  units "), HasSubstr("record"), HasSubstr("export")));
  EXPECT_THAT(weft({"record", "--help"}).out, HasSubstr("--until-rest"));
  EXPECT_EQ(weft({"help"}).out, help.out);
  EXPECT_EQ(weft({"help", "scene", "new"}).out, weft({"scene", "new", "--help"}).out);
  const Outcome unknown = weft({"help", "knit"});
  EXPECT_EQ(unknown.exit, 2);
  EXPECT_THAT(unknown.err, HasSubstr("there is no command or topic \"knit\""));
}

TEST_F(CommandsTest, TheLastLookOfTopStaysOnATerminal) {
  std::ostringstream out, err;
  const client::Terminal terminal{out, err, true, true};
  client::run_weft({"top", "--looks", "1", "--interval", "0.01", "--server", address_}, terminal,
                   {});
  EXPECT_THAT(out.str(), AllOf(HasSubstr("sessions "), Not(HasSubstr("\x1b[J"))));
}

TEST_F(CommandsTest, LongNamesLoseTheirMiddleOnATerminalAlone) {
  const std::string name = "a-" + std::string(40, 'x') + "-name";
  ask({"scene", "new", "--template", "hang", "-o", path("scene.json")});
  ask({"session", "create", path("scene.json"), "--id", name});
  ask({"session", "create", path("scene.json"), "--id", "short"});
  std::ostringstream out, err;
  client::run_weft({"session", "list", "--server", address_}, {out, err, true, true, 60}, {});
  EXPECT_THAT(out.str(), AllOf(HasSubstr("sessions/a...xxxx-name  ")));
  EXPECT_THAT(out.str(), HasSubstr("sessions/short "));
  EXPECT_THAT(lines_of(out.str()), Each(SizeIs(Le(60))));
  EXPECT_THAT(weft({"session", "list"}).out, HasSubstr("sessions/" + name + "  paused"));
}

TEST_F(CommandsTest, HelpOfEveryCommandAndTopicFits80Columns) {
  const auto words = [](std::vector<std::string> before) {
    before.insert(before.begin(), {"completion", "words", "help"});
    before.emplace_back();
    return lines_of(run_weft(before).out);
  };
  std::vector<std::vector<std::string>> all{{}};
  for (const std::string& word : words({})) {
    all.push_back({word});
    if (word == "help") continue;
    for (const std::string& below : words({word})) all.push_back({word, below});
  }
  EXPECT_GT(all.size(), 60);
  for (std::vector<std::string>& each : all) {
    each.insert(each.begin(), "help");
    const Outcome help = weft(each);
    EXPECT_EQ(help.exit, 0) << help.err;
    EXPECT_THAT(lines_of(help.out), Each(SizeIs(Le(80)))) << help.out;
  }
}

TEST_F(CommandsTest, TheTopicOnErrorsNamesWhatTheyHave) {
  const Outcome error = weft({"session", "get", "nobody", "--json"});
  const auto told = weft({"help", "errors"}).out;
  EXPECT_THAT(told, HasSubstr("\n  " + std::to_string(error.exit) + "    refused by the server"));
  const auto fields = nlohmann::json::parse(error.err)["error"];
  for (const auto& [name, value] : fields.items()) EXPECT_THAT(told, HasSubstr('"' + name + '"'));
  EXPECT_THAT(told, HasSubstr(fields["reason"].get<std::string>()));
}

TEST_F(CommandsTest, AWrongCommandLineIsToldWhatThereIs) {
  const auto told = [&](const std::vector<std::string>& arguments) {
    const Outcome outcome = weft(arguments);
    EXPECT_EQ(outcome.exit, 2);
    return outcome.err;
  };
  EXPECT_EQ(told({"recrod", "drape"}), "weft: weft has no command recrod; see weft --help\n");
  EXPECT_EQ(told({"scene", "knit"}),
            "weft: weft scene has no command knit; see weft scene --help\n");
  EXPECT_EQ(told({"run", "drape", "--fast"}),
            "weft: weft run has no option --fast; see weft run --help\n");
  EXPECT_EQ(told({"run", "drape", "fast"}),
            "weft: weft run has no further argument fast; see weft run --help\n");
  EXPECT_THAT(told({"export", "a.weft", "--format", "fbx", "-o", "a"}),
              HasSubstr("\"fbx\" is none of csv, gltf, mdd, npz, obj, pc2, usda, vtk"));
}

TEST_F(CommandsTest, ARefusalNamesWhatTheUserGave) {
  service_.create(small_scene(), "drape");
  ask({"step", "drape", "--frames", "10"});
  const auto told = [&](const std::vector<std::string>& arguments) {
    const Outcome outcome = weft(arguments);
    EXPECT_EQ(outcome.exit, 1);
    return outcome.err;
  };
  EXPECT_EQ(told({"watch", "drape", "--to", "3"}),
            "weft: --to: 3 lies before the first frame, 10\n");
  EXPECT_THAT(told({"record", "drape", "--from", "-1", "-o", path("a")}), HasSubstr(" --from: -1"));
  EXPECT_THAT(told({"run", "drape", "--until-frame", "3"}), HasSubstr(" --until-frame: "));
  EXPECT_THAT(told({"session", "snapshot", "drape", "--id", "A"}), HasSubstr(" --id: \"A\""));
  EXPECT_THAT(told({"session", "get", "no name"}), HasSubstr(" SESSION: \"sessions/no name\""));
  EXPECT_THAT(told({"act", "grab", "drape", "1,1", "--to", "1e9,0,0"}), HasSubstr(" --to: 1e+09"));
  EXPECT_THAT(told({"act", "grab", "drape", "1,1", "--to", "0,0,0", "--over", "1e9"}),
              HasSubstr(" --over: 1e+09"));
  const auto error =
      nlohmann::json::parse(told({"watch", "drape", "--to", "3", "--json"}))["error"];
  EXPECT_EQ(error["violations"][0]["field"], "--to");
  EXPECT_EQ(error["message"], "--to: 3 lies before the first frame, 10");
}

TEST_F(CommandsTest, AShellCompletesCommandsOptionsValuesAndSessions) {
  service_.create(small_scene(), "drape");
  setenv("WEFT_SERVER", address_.c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
  const auto completed = [](std::vector<std::string> words) {
    words.insert(words.begin(), {"completion", "words"});
    return run_weft(words).out;
  };
  EXPECT_EQ(completed({"text"}), "textile\n");
  EXPECT_EQ(completed({"session", ""}),
            "create\ndelete\nget\nlist\nrestore\nsnapshot\nsnapshots\n");
  EXPECT_EQ(completed({"record", "drape", "--e"}), "--embedded\n--encoding\n");
  EXPECT_EQ(completed({"export", "a.weft", "--format", "p"}), "pc2\n");
  EXPECT_EQ(completed({"run", ""}), "drape\n");
  EXPECT_EQ(completed({"export", ""}), "") << "the shell names files";
  EXPECT_EQ(completed({"help", "sc"}), "scene\nscenes\nscript\nscripting\n");
  EXPECT_EQ(completed({"help", "scene", "n"}), "new\n");
  unsetenv("WEFT_SERVER");  // NOLINT(concurrency-mt-unsafe)
}

TEST_F(CommandsTest, EveryErrorIsJsonWhenAskedFor) {
  for (const std::vector<std::string>& command :
       std::vector<std::vector<std::string>>{{"session", "get", "nobody"},
                                             {"step"},
                                             {"scene", "check", path("missing.json")},
                                             {"info", path("missing.weft")}}) {
    std::vector<std::string> arguments = command;
    arguments.emplace_back("--json");
    const Outcome outcome = weft(arguments);
    EXPECT_EQ(outcome.out, "");
    const auto errors = json_lines(outcome.err);
    ASSERT_THAT(errors, SizeIs(1));
    const auto& error = errors[0].fields().at("error").struct_value().fields();
    EXPECT_NE(error.at("code").string_value(), "");
    EXPECT_NE(error.at("reason").string_value(), "");
    EXPECT_NE(error.at("message").string_value(), "");
  }
}

TEST_F(CommandsTest, EveryAnswerIsOneJsonDocumentWhenAskedFor) {
  const std::string scene = scene_file(small_scene());
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"scene", "new", "--template", "flag", "-o", path("flag.json")},
           {"scene", "check", scene},
           {"session", "create", scene, "--id", "cloth"},
           {"session", "get", "cloth"},
           {"session", "list"},
           {"textile", "list"},
           {"textile", "show", "denim_11oz"},
           {"textile", "set", "--set", "bend_n_m2=2e-5", "cloth"},
           {"step", "cloth", "--frames", "3"},
           {"run", "cloth", "--until-frame", "6", "--wait"},
           {"record", "cloth", "--from", "0", "--to", "6", "-o", path("cloth.weft")},
           {"info", path("cloth.weft")},
           {"verify", path("cloth.weft")},
           {"diff", path("cloth.weft"), path("cloth.weft")},
           {"export", path("cloth.weft"), "--format", "obj", "-o", path("cloth")},
           {"run", "cloth"},
           {"pause", "cloth"},
           {"session", "delete", "cloth"}}) {
    std::vector<std::string> arguments = command;
    arguments.emplace_back("--json");
    const Outcome outcome = weft(arguments);
    EXPECT_EQ(outcome.exit, 0) << command[0] << ": " << outcome.err;
    EXPECT_THAT(json_lines(outcome.out), SizeIs(1)) << command[0];
    EXPECT_EQ(outcome.err, "");
  }
}

TEST_F(CommandsTest, AFieldThatScenesLackIsNamedWithItsLine) {
  const std::string file = path("scene.json");
  write_file(file, "{\n  \"sheetz\": []\n}");
  EXPECT_THAT(weft({"scene", "check", file}).err,
              HasSubstr("scene.json, line 2: no such field: sheetz"));
}

TEST_F(CommandsTest, ASceneThatNoRequestCanHoldIsRefusedWithItsSize) {
  v1::Scene scene = small_scene();
  scene.mutable_sheets(0)->set_name(std::string(17 << 20, 'x'));
  const Outcome refused = weft({"scene", "check", scene_file(scene), "--json"});
  EXPECT_EQ(refused.exit, 1);
  EXPECT_EQ(nlohmann::json::parse(refused.err)["error"]["reason"], "REQUEST_TOO_LARGE");
}

TEST_F(CommandsTest, ATextileValueIsChangedWhileTheSessionRuns) {
  service_.create(small_scene(), "cloth");
  ask({"run", "cloth"});
  const auto set = ask({"textile", "set", "cloth", "--set", "bend_n_m2=3e-5", "--set",
                        "damping_kg_per_s=0.001", "--set", "raw.shear_n_per_m=90"});
  EXPECT_GT(set["applied_frame"], 0);
  EXPECT_EQ(set["textile"]["raw"]["bend_n_m2"], 3e-5);
  EXPECT_EQ(set["textile"]["raw"]["shear_n_per_m"], 90);
  EXPECT_EQ(set["textile"]["raw"]["stretch_n_per_m"], 200);
  EXPECT_EQ(set["textile"]["damping_kg_per_s"], 0.001);

  const auto preset = ask({"textile", "set", "cloth", "--preset", "denim_11oz"});
  EXPECT_GT(preset["textile"]["measured"]["areal_density_kg_per_m2"], 0);
  EXPECT_EQ(preset["textile"]["damping_kg_per_s"], 0.001) << "is not the preset's";
}

TEST_F(CommandsTest, ATextileChangesOverTheTimeGiven) {
  service_.create(small_scene(), "cloth");
  const auto set =
      ask({"textile", "set", "cloth", "--set", "stretch_n_per_m=400", "--over", "0.1"});
  EXPECT_EQ(set["textile"]["raw"]["stretch_n_per_m"], 400);
  ask({"step", "cloth", "--frames", "3"});
  const auto half = ask({"session", "get", "cloth"});
  EXPECT_DOUBLE_EQ(half["scene"]["sheets"][0]["textile"]["raw"]["stretch_n_per_m"], 300);
  const Outcome long_ = weft({"textile", "set", "cloth", "--set", "bend_n_m2=0", "--over", "1e5"});
  EXPECT_THAT(long_.err, HasSubstr("--over: 1e+05 s is not within 0 to 10000 s"));
}

TEST_F(CommandsTest, ABadTextileValueIsNamed) {
  service_.create(small_scene(), "cloth");
  const Outcome negative = weft({"textile", "set", "cloth", "--set", "bend_n_m2=-1"});
  EXPECT_EQ(negative.exit, 1);
  EXPECT_THAT(negative.err, AllOf(HasSubstr("raw.bend_n_m2"), HasSubstr("-1")));
  EXPECT_EQ(weft({"textile", "set", "cloth", "--set", "weight=1"}).exit, 2);
  EXPECT_EQ(weft({"textile", "set", "cloth", "--set", "bend_n_m2=soft"}).exit, 2);
  EXPECT_EQ(weft({"textile", "set", "cloth"}).exit, 2);
}

TEST_F(CommandsTest, WatchWritesEveryFrameAsAJsonLine) {
  service_.create(small_scene(), "cloth");
  const Outcome outcome = weft({"watch", "cloth", "--run", "--to", "20", "--json"});
  EXPECT_EQ(outcome.exit, 0) << outcome.err;
  const auto lines = json_lines(outcome.out);
  ASSERT_THAT(lines, SizeIs(21));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    EXPECT_EQ(lines[i].fields().at("frame").number_value(), static_cast<double>(i));
    EXPECT_EQ(lines[i].fields().count("kinetic_energy_j"), 1);
  }
}

TEST_F(CommandsTest, WatchWritesPlainLinesWhereNobodyLooks) {
  service_.create(small_scene(), "cloth");
  const Outcome outcome = weft({"watch", "cloth", "--run", "--to", "20"});
  EXPECT_EQ(outcome.exit, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("KINETIC J"), HasSubstr("\n      20 ")));
  EXPECT_EQ(outcome.out.find('\x1b'), std::string::npos);
}

TEST_F(CommandsTest, RunWaitsForItsEnd) {
  service_.create(small_scene(), "cloth");
  EXPECT_EQ(ask({"run", "cloth", "--until-frame", "40", "--wait"})["frame"], 40);
  EXPECT_EQ(ask({"session", "get", "cloth"})["state"], "SESSION_STATE_PAUSED");
}

TEST_F(CommandsTest, RunSaysWhyTheSolverGaveUp) {
  service_.create(diverging_scene(), "cloth");
  const Outcome outcome = weft({"run", "cloth", "--wait", "--json"});
  EXPECT_EQ(outcome.exit, 1);
  EXPECT_EQ(nlohmann::json::parse(outcome.err)["error"]["reason"], "SOLVER_FAILED");
}

TEST_F(CommandsTest, StepRefusesAnotherFrameThanTheOneExpected) {
  service_.create(small_scene(), "cloth");
  EXPECT_EQ(weft({"step", "cloth", "--expected-frame", "0"}).exit, 0);
  EXPECT_EQ(weft({"step", "cloth", "--expected-frame", "0"}).exit, 1);
}

TEST_F(CommandsTest, EmbeddedNeedsNoServer) {
  const std::string scene = scene_file(small_scene());
  const std::string recording = path("cloth.weft");
  EXPECT_EQ(run_weft({"scene", "check", scene, "--embedded"}).exit, 0);
  const Outcome recorded =
      run_weft({"record", scene, "--to", "30", "-o", recording, "--embedded", "--json"});
  EXPECT_EQ(recorded.exit, 0) << recorded.err;
  EXPECT_EQ(recorded.json()["frames"], 31);
  const Outcome ran = run_weft({"run", scene, "--until-frame", "5", "--embedded", "--json"});
  EXPECT_EQ(ran.json()["frame"], 5) << "it waits, or the session would be lost";
  EXPECT_EQ(run_weft({"pause", scene, "--embedded"}).exit, 2);
}

TEST_F(CommandsTest, AStopEndsAWaitingCommand) {
  const v1::Session session = service_.create(small_scene(), "cloth");
  std::stop_source stop;
  Outcome outcome;
  std::thread waiting([&] { outcome = weft({"run", "cloth", "--wait"}, stop.get_token()); });
  while (service_.get(session).frame() < 3) std::this_thread::yield();
  stop.request_stop();
  waiting.join();
  EXPECT_EQ(outcome.exit, 130);
}

TEST(DefaultServer, IsWhereWeftdListens) {
  const char* const arguments[] = {"weftd"};
  const ServerOptions server = read_config(1, arguments).server;
  EXPECT_EQ(*server.host + ':' + std::to_string(server.port), client::kDefaultServer);
}

TEST_F(CommandsTest, AStepThatIsInterruptedEnds) {
  constexpr std::int64_t kFrames = 100'000;
  const v1::Session session = service_.create(small_scene(), "cloth");
  std::stop_source stop;
  Outcome outcome;
  std::thread stepping([&] {
    outcome = weft({"step", "cloth", "--frames", std::to_string(kFrames)}, stop.get_token());
  });
  while (service_.get(session).frame() == 0) std::this_thread::yield();
  stop.request_stop();
  stepping.join();
  EXPECT_EQ(outcome.exit, 130);
  const std::int64_t frame = service_.get(session).frame();
  EXPECT_LT(frame, kFrames);
  EXPECT_EQ(service_.get(session).frame(), frame);
}

}  // namespace
}  // namespace weft::testing

#include "client/load/load.h"

#include <gmock/gmock.h>

#include <chrono>
#include <thread>

#include "client/connection.h"
#include "client/input_file.h"
#include "client/load/limit.h"
#include "tests/client/breaking_proxy.h"
#include "tests/client/client_test.h"

namespace weft::testing {
namespace {

using client::Drive;
using client::Latencies;
using std::chrono::milliseconds;
using ::testing::HasSubstr;
using ::testing::Not;

using LoadTest = ClientTest;

TEST(Latencies, AreKnownWithinAHundredth) {
  Latencies latencies;
  EXPECT_EQ(latencies.quantile(0.5), 0);
  for (int i = 1000; i >= 1; --i) latencies.add(1e-4 * i);
  latencies.add(-1);  // before its time
  EXPECT_EQ(latencies.count(), 1001);
  EXPECT_EQ(latencies.quantile(0), 0);
  EXPECT_NEAR(latencies.quantile(0.5), 0.05, 0.05 * 0.01);
  EXPECT_NEAR(latencies.quantile(0.99), 0.099, 0.099 * 0.01);
  EXPECT_EQ(latencies.quantile(1), 0.1);
  latencies.add(3600, 1001);
  EXPECT_NEAR(latencies.quantile(0.51), 3600, 36);
}

TEST_F(LoadTest, EverySubscriberReceivesEveryFrameOnceHoweverSessionsAdvance) {
  for (const char* drive : {"paced", "stepped", "free"}) {
    SCOPED_TRACE(drive);
    const auto result = ask({"load", "--scene", scene_file(small_scene()), "--sessions", "3",
                             "--subscribers", "2", "--drive", drive, "--rate", "200", "--ramp",
                             "0.05", "--frames", "40", "--duration", "30"});
    EXPECT_EQ(result["sessions_created"], 3);
    EXPECT_EQ(result["create_s"]["count"], 3);
    EXPECT_EQ(result["frames_received"], 3 * 2 * 40);
    EXPECT_EQ(result["frames_lost"], 0);
    EXPECT_EQ(result["frames_doubled"], 0);
    EXPECT_EQ(result["planned_substeps"].get<int>() % (3 * 40), 0);  // as many for each frame
    EXPECT_GT(result["planned_substeps"], 3 * 40);
    EXPECT_TRUE(result["errors"].empty());
    EXPECT_TRUE(ask({"session", "list"})["sessions"].empty());
  }
}

TEST_F(LoadTest, GarmentsArePutOnAndEachVerdictIsCounted) {
  const Outcome load = weft({"load", "--scene", scene_file(small_scene()), "--garments", "3",
                             "--at-once", "2", "--seconds", "0.1", "--json"});
  EXPECT_EQ(load.exit, 1);
  EXPECT_THAT(load.err, HasSubstr("3 of 3 garments do not sit well"));
  EXPECT_EQ(load.json()["garments"], 3);
  EXPECT_EQ(load.json()["good"], 0);
  EXPECT_EQ(load.json()["faults"]["NOT_AT_REST"], 3);
  EXPECT_TRUE(load.json()["errors"].empty());
  EXPECT_GT(load.json()["garments_per_hour"], 0);
  EXPECT_TRUE(ask({"session", "list"})["sessions"].empty());
}

client::LoadResult apply_at_once(const std::string& address, client::LoadOrder& order) {
  order.ramp = milliseconds(0);
  const auto connection = client::Connection::to(address, {});
  // the first answer of a server takes it a while
  connection->call(&v1::ServerService::Stub::GetServerInfo, v1::GetServerInfoRequest());
  return client::apply_load(*connection, order);
}

// Most frames never came; each counts with what it had waited.
void expect_late(const client::LoadResult& result, const client::LoadOrder& order) {
  ASSERT_LT(result.frames_received, result.frames_due / 2);
  EXPECT_EQ(result.frame.count(), result.frames_due);
  const double whole_time = static_cast<double>(result.frames_due) / order.rate_per_s;
  EXPECT_GE(result.frame.quantile(0.9), 0.3 * whole_time);
}

// More steps are due than one call after the other could ever do.
TEST_F(LoadTest, StepsThatWaitForOthersCountFromWhenTheyWereDue) {
  client::LoadOrder order{.scene = small_scene(), .sessions = 1, .drive = Drive::kStepped};
  order.rate_per_s = 1e5;
  order.duration = milliseconds(300);
  const client::LoadResult result = apply_at_once(address_, order);
  expect_late(result, order);
  EXPECT_EQ(result.step.count(), result.frames_due);
  EXPECT_EQ(result.frames_lost, 0);
}

// A server that computes a frame every 50 ms at best is asked for one every 2 ms.
TEST_F(LoadTest, FramesThatAPacedSessionNeverComputedCountAsTheyHadWaited) {
  v1::Scene scene = small_scene();
  scene.mutable_solver()->set_frame_step_s(1);
  scene.mutable_solver()->set_substep_s(5e-6);
  client::LoadOrder order{.scene = scene, .sessions = 1};
  order.rate_per_s = 500;
  order.duration = milliseconds(500);
  const client::LoadResult result = apply_at_once(address_, order);
  expect_late(result, order);
  EXPECT_TRUE(result.clean());
}

TEST_F(LoadTest, CountsErrorsByReason) {
  const Outcome outcome =
      weft({"load", "--scene", scene_file(diverging_scene()), "--drive", "stepped", "--rate", "100",
            "--sessions", "1", "--ramp", "0", "--frames", "1000", "--json"});
  EXPECT_EQ(outcome.exit, 1);
  EXPECT_THAT(outcome.err, HasSubstr("LOAD_FAILED"));
  const auto errors = outcome.json()["errors"];
  EXPECT_GT(errors.value("step: SOLVER_FAILED", 0), 0) << errors;
  EXPECT_EQ(errors.value("stream: SOLVER_FAILED", 0), 1) << errors;
  EXPECT_TRUE(ask({"session", "list"})["sessions"].empty());
}

TEST_F(LoadTest, FramesThatAStreamDidNotBringAreLost) {
  // of calls, of a hundred streams, and of one more: the second or third breaks, the other goes on
  const BreakingProxy proxy(address_, {.breaks = 2, .after_bytes = 8'000});
  const Outcome outcome =
      run_weft({"load", "--scene", scene_file(small_scene()), "--drive", "free", "--sessions", "1",
                "--subscribers", "101", "--ramp", "0", "--frames", "100", "--duration", "60",
                "--json", "--server", proxy.address()});
  EXPECT_EQ(outcome.exit, 1);
  const auto result = outcome.json();
  EXPECT_EQ(proxy.broken(), 1);
  EXPECT_GE(result["errors"].value("stream: NO_CONNECTION", 0), 1) << result;
  EXPECT_GT(result["frames_lost"], 0);
  EXPECT_EQ(result["frames_lost"].get<int>() + result["frames_received"].get<int>(), 101 * 100);
  EXPECT_EQ(result["frames_doubled"], 0);
}

TEST_F(LoadTest, FindsTheMostSessionsThatAServerHolds) {
  ServerOptions options;
  options.limits.max_sessions = 5;
  const Service bounded(options);
  const auto connection = client::Connection::to(bounded.server.address(), {});
  client::LoadOrder order{.scene = small_scene()};
  order.ramp = milliseconds(0);
  order.duration = milliseconds(50);
  std::vector<int> tried;
  std::vector<int> held;
  const int limit = client::find_limit(*connection, order, {.first = 2, .target_s = 100},
                                       [&](const client::Probe& probe) {
                                         tried.push_back(probe.sessions);
                                         if (probe.holds) held.push_back(probe.sessions);
                                       });
  EXPECT_EQ(limit, 5);
  EXPECT_THAT(tried, ::testing::ElementsAre(2, 4, 8, 6, 5));
  EXPECT_THAT(held, ::testing::ElementsAre(2, 4, 5));
}

TEST_F(LoadTest, StagesAddSessionsAndHaveFiguresOfTheirOwn) {
  const auto result = ask({"load", "--scene", scene_file(small_scene()), "--stages", "1,3",
                           "--rate", "100", "--ramp", "0.1", "--duration", "0.4"});
  EXPECT_EQ(result["sessions_created"], 3);
  const auto& stages = result["stages"];
  ASSERT_EQ(stages.size(), 2U);
  EXPECT_EQ(stages[0]["sessions"], 1);
  EXPECT_EQ(stages[0]["create_s"]["count"], 1);
  EXPECT_EQ(stages[1]["sessions"], 3);
  EXPECT_EQ(stages[1]["create_s"]["count"], 2);
  const auto frames = [](const auto& of) { return of["frame_s"]["count"].template get<int>(); };
  EXPECT_NEAR(frames(stages[0]), 40, 5);
  EXPECT_NEAR(frames(stages[1]), 120, 15);
  EXPECT_EQ(frames(stages[0]) + frames(stages[1]), frames(result));
}

// A stage that the server cannot hold does not spoil the figures of the one before.
TEST_F(LoadTest, WhatAStageIsRefusedCountsThere) {
  ServerOptions options;
  options.limits.max_sessions = 2;
  const Service bounded(options);
  const auto connection = client::Connection::to(bounded.server.address(), {});
  client::LoadOrder order{.scene = small_scene(), .stages = {2, 3}};
  order.ramp = milliseconds(50);
  order.duration = milliseconds(50);
  const client::LoadResult result = client::apply_load(*connection, order);
  EXPECT_EQ(result.stages[0].errors, 0);
  EXPECT_EQ(result.stages[1].errors, 1);
}

TEST_F(LoadTest, IsComparedWithAnEarlierOne) {
  const std::vector<std::string> load{"load",       "--scene", scene_file(small_scene()),
                                      "--sessions", "1",       "--ramp",
                                      "0",          "--rate",  "100",
                                      "--duration", "0.1"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), load.begin(), load.end());
    return weft(more);
  };
  write_file(path("earlier.json"), with({"--json"}).out);
  const Outcome compared = with({"--against", path("earlier.json")});
  EXPECT_EQ(compared.exit, 0) << compared.err;
  EXPECT_THAT(compared.out, HasSubstr("frame p99"));
  write_file(path("later.json"), with({"--json"}).out);
  const Outcome files = run_weft({"load", "--compare", path("earlier.json"), path("later.json")});
  EXPECT_EQ(files.exit, 0) << files.err;
  EXPECT_THAT(files.out, HasSubstr("frame p99"));
  write_file(path("other.json"), R"({"frames": 3})");
  EXPECT_EQ(with({"--against", path("other.json")}).exit, 4);
}

TEST_F(LoadTest, IsWrittenAsAPageThatAsksForNothing) {
  const std::string page = path("load.html"), before = path("before.json");
  const std::vector<std::string> load{"load",   "--scene", scene_file(small_scene()),
                                      "--ramp", "0.05",    "--duration",
                                      "0.3",    "--rate",  "100"};
  auto stages = load;
  stages.insert(stages.end(), {"--stages", "1,3", "-o", page});
  write_file(before, ask(stages).dump());
  const std::string text = client::read_text(page);
  EXPECT_THAT(text, HasSubstr("<td>1 session</td>"));
  EXPECT_THAT(text, HasSubstr("<td>3 sessions</td>"));
  EXPECT_THAT(text, HasSubstr("How late frames came"));
  EXPECT_THAT(text, HasSubstr("Lateness of frames"));
  EXPECT_THAT(text, Not(HasSubstr("<script")));
  EXPECT_THAT(text, Not(HasSubstr("href")));
  ask({"load", "--compare", before, before, "-o", page});
  EXPECT_THAT(client::read_text(page), HasSubstr("<td>now</td>"));

  auto nowhere = load;
  nowhere.insert(nowhere.end(), {"-o", path("gone/load.html")});
  EXPECT_THAT(weft(nowhere).err, HasSubstr("gone/load.html"));
}

TEST_F(LoadTest, AStopEndsItAndItsSessions) {
  const std::string scene = scene_file(small_scene());
  std::stop_source stop;
  Outcome outcome;
  std::thread loading([&] {
    outcome =
        weft({"load", "--scene", scene, "--sessions", "2", "--duration", "1000"}, stop.get_token());
  });
  const auto is_loaded = [&] {
    const auto list = ask({"session", "list"})["sessions"];
    return list.size() == 2 && list[0]["frame"] > 3 && list[1]["frame"] > 3;
  };
  while (!is_loaded()) std::this_thread::yield();
  stop.request_stop();
  loading.join();
  EXPECT_EQ(outcome.exit, 130);
  EXPECT_THAT(outcome.out, HasSubstr("0 lost, 0 doubled"));
  EXPECT_TRUE(ask({"session", "list"})["sessions"].empty());
}

TEST_F(LoadTest, RefusesWhatMakesNoSense) {
  const std::string scene = scene_file(small_scene());
  EXPECT_EQ(weft({"load", "--scene", scene, "--drive", "free", "--find-limit"}).exit, 2);
  EXPECT_EQ(weft({"load", "--scene", scene, "--frames", "5", "--subscribers", "0"}).exit, 2);
  EXPECT_EQ(weft({"load", "--scene", scene, "--find-limit", "--subscribers", "0"}).exit, 2);
  EXPECT_EQ(weft({"load", "--scene", scene, "--template", "load"}).exit, 2);
  EXPECT_EQ(weft({"load", "--scene", scene, "--target", "1"}).exit, 2);
  const Outcome too_fast = weft({"load", "--scene", scene, "--rate", "99999"});
  EXPECT_EQ(too_fast.exit, 2);
  EXPECT_THAT(too_fast.err, HasSubstr("times real time"));
  for (const char* stages : {"0,2", "3,2", "2,2"})
    EXPECT_EQ(weft({"load", "--scene", scene, "--stages", stages}).exit, 2) << stages;
  EXPECT_EQ(weft({"load", "--scene", scene, "--stages", "1,2", "--find-limit"}).exit, 2);
  EXPECT_EQ(weft({"load", "--scene", scene, "--stages", "1,2", "--frames", "3"}).exit, 2);
  EXPECT_EQ(weft({"load", "--scene", path("missing.json")}).exit, 4);
  v1::Scene bad = small_scene();
  bad.mutable_sheets(0)->mutable_grid()->set_rows(1);
  const Outcome refused = weft({"load", "--scene", scene_file(bad)});
  EXPECT_EQ(refused.exit, 1);
  EXPECT_THAT(refused.err, HasSubstr("sheets[0].grid.rows"));
}

}  // namespace
}  // namespace weft::testing

#include <gmock/gmock.h>

#include "client/recording/reader.h"
#include "client/recording/writer.h"
#include "client/replay/replay_server.h"
#include "tests/client/client_test.h"

namespace weft::testing {
namespace {

using ::testing::HasSubstr;

// A recording of frames 0 to 20, and commands that ask its replay.
class ReplayTest : public ClientTest {
 protected:
  void record() { ask({"record", id_, "--run", "--to", "20", "-o", file_}); }
  Outcome ask_replay(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--server", replay_->address()});
    return run_weft(std::move(arguments));
  }
  void replay(double time_scale = 0) {
    replay_ = std::make_unique<client::ReplayServer>(file_, "127.0.0.1:0", time_scale);
  }
  bool is_bit_equal(const std::string& other) {
    return ask({"diff", file_, other})["bit_equal"].get<bool>();
  }
  // How a command that is refused ends.
  std::string refusal(std::vector<std::string> arguments) {
    arguments.emplace_back("--json");
    const Outcome outcome = ask_replay(std::move(arguments));
    EXPECT_EQ(outcome.exit, 1) << outcome.out;
    return nlohmann::json::parse(outcome.err)["error"]["reason"];
  }

  const v1::Session session_ = service_.create();
  const std::string id_ = session_.name().substr(session_.name().find('/') + 1);
  const std::string file_ = path("original.weft");
  std::unique_ptr<client::ReplayServer> replay_;
};

TEST_F(ReplayTest, ARecordingOfAReplayHasTheBitsOfTheOriginal) {
  record();
  for (const std::string encoding : {"float32", "float64", "quantized"}) {
    ask({"record", id_, "--from", "0", "--to", "20", "--encoding", encoding, "-o", file_,
         "--force"});
    replay();
    const std::string copy = path(encoding + ".weft");
    const Outcome outcome =
        ask_replay({"record", id_, "--run", "--to", "20", "--encoding", encoding, "-o", copy});
    EXPECT_EQ(outcome.exit, 0) << outcome.err;
    EXPECT_TRUE(is_bit_equal(copy)) << encoding;
    EXPECT_EQ(ask({"verify", copy})["faults"], 0);
  }
}

TEST_F(ReplayTest, PressureAndClearanceAreThoseThatWereRecorded) {
  v1::Scene scene = small_scene();
  scene.add_colliders()->mutable_sphere()->set_radius_m(0.05);
  service_.create(scene, "ball");
  const std::vector<std::string> both{"--pressure", "--clearance", "--encoding", "float64"};
  const auto recorded = [&](std::vector<std::string> command) {
    command.insert(command.end(), both.begin(), both.end());
    return command;
  };
  ask(recorded({"record", "ball", "--run", "--to", "20", "-o", file_}));
  replay();
  const std::string copy = path("copy.weft");
  const Outcome outcome =
      ask_replay(recorded({"record", "ball", "--run", "--to", "20", "-o", copy}));
  ASSERT_EQ(outcome.exit, 0) << outcome.err;
  client::RecordingReader one(file_), other(copy);
  for (const std::int64_t frame : {0, 20}) {
    EXPECT_EQ(other.read(frame).pressure_pa(), one.read(frame).pressure_pa());
    EXPECT_EQ(other.read(frame).clearance_m(), one.read(frame).clearance_m());
    EXPECT_EQ(one.read(frame).clearance_m().size(), 20 * sizeof(double));
  }
  EXPECT_THAT(run_weft({"info", copy}).out, HasSubstr("positions, pressure, clearance, float64"));

  ask({"record", "ball", "--from", "0", "--to", "20", "-o", file_, "--force"});
  replay();
  const Outcome refused = ask_replay(recorded({"record", "ball", "-o", path("no.weft")}));
  EXPECT_EQ(refused.exit, 1);
  EXPECT_THAT(refused.err, HasSubstr("was not recorded; weft record --pressure does"));
}

TEST_F(ReplayTest, FramesComeAtTheirTimeAndStay) {
  record();
  replay(1000);
  const Outcome watched = ask_replay({"watch", id_, "--to", "20", "--json"});
  EXPECT_EQ(watched.exit, 0) << watched.err;
  const std::string late = path("late.weft");
  EXPECT_EQ(ask_replay({"record", id_, "--from", "3", "--to", "20", "-o", late}).exit, 0);
  EXPECT_EQ(client::RecordingReader(late).first_frame(), 3);
}

TEST_F(ReplayTest, APacedReplayTakesItsTime) {
  record();
  const auto begin = std::chrono::steady_clock::now();
  replay(2);
  EXPECT_EQ(ask_replay({"watch", id_, "--to", "20"}).exit, 0);
  const double recorded = client::RecordingReader(file_).read(20).time_s();
  EXPECT_GE(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(),
            recorded / 2);
}

TEST_F(ReplayTest, RunsPausesAndStepsAsAnySession) {
  record();
  replay();
  const auto told = [&](std::vector<std::string> arguments) {
    arguments.emplace_back("--json");
    const Outcome outcome = ask_replay(std::move(arguments));
    EXPECT_EQ(outcome.exit, 0) << outcome.err;
    return outcome.json();
  };
  EXPECT_EQ(told({"step", id_, "--frames", "4"})["frame"], 4);
  EXPECT_EQ(told({"run", id_, "--until-frame", "9"})["applied_frame"], 5);
  EXPECT_EQ(ask_replay({"watch", id_, "--to", "9"}).exit, 0);
  const auto shown = told({"session", "get", id_});
  EXPECT_EQ(shown["frame"], 9);
  EXPECT_EQ(shown["uid"], session_.uid());
  EXPECT_EQ(refusal({"run", id_, "--until-frame", "9"}), "FIELD_INVALID");
  EXPECT_EQ(refusal({"step", id_, "--frames", "12"}), "RECORDING_ENDED");
  EXPECT_EQ(told({"step", id_, "--frames", "11"})["frame"], 20);
  EXPECT_EQ(refusal({"run", id_}), "RECORDING_ENDED");
}

TEST_F(ReplayTest, WhatWouldChangeItIsRefusedInOneSentence) {
  record();
  replay();
  EXPECT_EQ(refusal({"session", "create", scene_file(small_scene()), "--id", "other"}), "REPLAY");
  EXPECT_EQ(refusal({"session", "delete", id_}), "REPLAY");
  EXPECT_EQ(refusal({"textile", "set", id_, "--preset", "denim_11oz"}), "REPLAY");
  EXPECT_EQ(refusal({"act", "release", id_, "0,0"}), "REPLAY");
  EXPECT_EQ(refusal({"session", "snapshot", id_}), "REPLAY");
  EXPECT_EQ(refusal({"session", "restore", id_, "frame-0"}), "REPLAY");
  EXPECT_EQ(ask_replay({"session", "snapshots", id_}).exit, 0);
  EXPECT_EQ(refusal({"session", "get", "other"}), "SESSION_NOT_FOUND");
  EXPECT_EQ(refusal({"record", id_, "--velocities", "-o", path("velocities.weft")}),
            "FIELD_INVALID");
  const Outcome lab = ask_replay({"lab", "cantilever", "--textile", "wool_tropical"});
  EXPECT_EQ(lab.exit, 1);
  EXPECT_THAT(lab.err, HasSubstr("is it a replay"));
}

TEST_F(ReplayTest, ViewersSeeTheNewestFrameForEachCredit) {
  record();
  replay();
  const auto frames = v1::FrameService::NewStub(
      grpc::CreateChannel(replay_->address(), grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  const auto view = frames->ViewFrames(&context);
  v1::ViewFramesRequest request;
  v1::ViewFramesResponse response;
  request.set_session(session_.name());
  request.set_credits(1);
  view->Write(request);
  ASSERT_TRUE(view->Read(&response));
  EXPECT_EQ(response.header().uid(), session_.uid());
  ASSERT_TRUE(view->Read(&response));
  EXPECT_EQ(response.frame().number(), 0);
  EXPECT_EQ(ask_replay({"step", id_, "--frames", "7"}).exit, 0);
  request.Clear();
  request.set_credits(1);
  view->Write(request);
  ASSERT_TRUE(view->Read(&response));
  EXPECT_EQ(response.frame().number(), 7);
  EXPECT_EQ(response.skipped_count(), 6);
  view->WritesDone();
  EXPECT_FALSE(view->Read(&response));
  EXPECT_TRUE(view->Finish().ok());
}

TEST_F(ReplayTest, ADamagedFrameEndsStreamsAfterTheLastGoodOne) {
  record();
  const std::string damaged = path("damaged.weft");
  {
    client::RecordingReader original(file_);
    client::RecordingWriter writer(damaged, false, original.scene(), original.header());
    for (std::int64_t number = 0; number <= 20; ++number) {
      v1::Frame frame = original.read(number);
      if (number == 7) frame.mutable_positions_m()->pop_back();
      writer.add(frame);
    }
  }
  replay_ = std::make_unique<client::ReplayServer>(damaged, "127.0.0.1:0", 0);
  const Outcome outcome =
      ask_replay({"record", id_, "--run", "--to", "20", "-o", path("good.weft")});
  EXPECT_EQ(outcome.exit, 1);
  EXPECT_THAT(outcome.err, HasSubstr("frame 7 is not as long as its header says"));
  EXPECT_EQ(client::RecordingReader(path("good.weft")).last_frame(), 6);
}

TEST_F(ReplayTest, TheCommandSaysWhereAndWhatItIsUntilItIsStopped) {
  record();
  std::stop_source stop;
  stop.request_stop();
  const Outcome outcome =
      run_weft({"replay", file_, "--listen", "127.0.0.1:0", "--json"}, stop.get_token());
  EXPECT_EQ(outcome.exit, 0) << outcome.err;
  EXPECT_EQ(outcome.json()["last_frame"], 20);
  EXPECT_EQ(outcome.json()["session"], session_.name());

  const Outcome taken = run_weft({"replay", file_, "--listen", address_});
  EXPECT_EQ(taken.exit, 1);
  EXPECT_THAT(taken.err, HasSubstr("cannot listen on " + address_));
  const Outcome open = run_weft({"replay", file_, "--listen", "0.0.0.0:0"});
  EXPECT_EQ(open.exit, 2);
  EXPECT_THAT(open.err, HasSubstr("--insecure"));
}

}  // namespace
}  // namespace weft::testing

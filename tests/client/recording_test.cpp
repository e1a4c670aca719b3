#include <gmock/gmock.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <thread>

#include "client/problem.h"
#include "client/recording/points.h"
#include "client/recording/reader.h"
#include "tests/client/breaking_proxy.h"
#include "tests/client/client_test.h"
#include "tests/support/service/process.h"

namespace weft::testing {
namespace {

using client::RecordingReader;
using ::testing::AllOf;
using ::testing::HasSubstr;

class RecordingTest : public ClientTest {
 protected:
  // Frames of the file.
  std::vector<v1::Frame> recorded(const std::string& file) const {
    RecordingReader reader(file);
    std::vector<v1::Frame> frames;
    for (auto number = reader.first_frame(); number <= reader.last_frame(); ++number)
      frames.push_back(reader.read(number));
    return frames;
  }

  // Waits until a recorder has put the frame into the file.
  void await_frame(const std::string& file, std::int64_t number) const {
    while (!has_frame(file, number)) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }

  void expect_equal(const std::vector<v1::Frame>& found, const std::vector<v1::Frame>& wanted) {
    ASSERT_EQ(found.size(), wanted.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      ASSERT_EQ(found[i].SerializeAsString(), wanted[i].SerializeAsString()) << "frame " << i;
    }
  }

  const std::string file_ = path("cloth.weft");
  const v1::Session session_ = service_.create(small_scene(), "cloth");

 private:
  static bool has_frame(const std::string& file, std::int64_t number) {
    if (!std::filesystem::exists(file)) return false;
    try {
      return RecordingReader(file).last_frame() >= number;
    } catch (const client::Problem&) {
      return false;  // not described yet
    }
  }
};

TEST_F(RecordingTest, HoldsEveryFrameBitEqualToTheStream) {
  ask({"record", "cloth", "--run", "--to", "200", "--encoding", "float64", "-o", file_});
  expect_equal(recorded(file_), stream("sessions/cloth", 0, 200, v1::FRAME_ENCODING_FLOAT64));
}

TEST_F(RecordingTest, HoldsVelocitiesWhereAsked) {
  ask({"record", "cloth", "--run", "--to", "3", "--velocities", "-o", file_});
  const auto frames = recorded(file_);
  ASSERT_EQ(frames.size(), 4);
  EXPECT_EQ(frames.back().velocities_m_per_s().size(), 20 * 3 * sizeof(float));
}

TEST_F(RecordingTest, HoldsQuantizedFramesWithinHalfAStep) {
  v1::Scene far = small_scene();
  *far.add_sheets() = far.sheets(0);
  far.mutable_sheets(1)->mutable_placement()->mutable_origin_m()->set_x(-9000);
  service_.create(far, "far");
  const std::string exact = path("exact.weft");
  ask({"record", "far", "--run", "--to", "20", "--encoding", "float64", "--velocities", "-o",
       exact});
  ask({"record", "far", "--from", "0", "--to", "20", "--encoding", "quantized", "--velocities",
       "-o", file_});
  EXPECT_LE(ask({"diff", exact, file_})["largest_m"], std::sqrt(3) * 0.5e-4 * (1 + 1e-6));
  EXPECT_THAT(weft({"info", file_}).out, HasSubstr("positions, velocities, quantized to 0.1 mm"));
  ask({"verify", file_});
  ask({"export", file_, "--format", "pc2", "-o", path("far.pc2")});
  RecordingReader reader(file_), truth(exact);
  const auto found = client::read_points(reader.read(9).velocities_m_per_s(), reader.header());
  const auto wanted = client::read_points(truth.read(9).velocities_m_per_s(), truth.header());
  for (std::size_t i = 0; i < wanted.y.size(); ++i) ASSERT_NEAR(found.y[i], wanted.y[i], 0.5e-4);
}

TEST_F(RecordingTest, JoinsFramesThatComeInSeveralMessages) {
  ServerOptions options;
  options.limits.max_frame_bytes = 1024;
  Service narrow(options);
  narrow.step(narrow.create(small_scene(), "cloth"), 20);
  service_.step(session_, 20);
  for (const std::string encoding : {"float64", "quantized"}) {
    const auto record = [&](const std::string& address, const std::string& file) {
      const Outcome outcome =
          run_weft({"record", "cloth", "--from", "0", "--to", "20", "--encoding", encoding,
                    "--velocities", "-o", file, "--server", address});
      EXPECT_EQ(outcome.exit, 0) << outcome.err;
      return recorded(file);
    };
    const std::string joined = path(encoding + "-joined.weft");
    expect_equal(record(narrow.server.address(), joined),
                 record(address_, path(encoding + ".weft")));
    ask({"verify", joined});
  }
}

TEST_F(RecordingTest, EndsAtRest) {
  const auto result = ask({"record", "cloth", "--run", "--until-rest", "-o", file_});
  EXPECT_EQ(result["at_rest"], true);
  EXPECT_EQ(result["complete"], true);
  EXPECT_TRUE(recorded(file_).back().stats().at_rest());
}

TEST_F(RecordingTest, EndsWithTheRun) {
  std::thread recording([&] { ask({"record", "cloth", "-o", file_}); });
  await_frame(file_, 0);
  service_.run(session_, 150);
  recording.join();
  EXPECT_EQ(recorded(file_).size(), 151);
}

TEST_F(RecordingTest, EndsCleanlyWhenItIsStopped) {
  std::stop_source stop;
  Outcome outcome;
  std::thread recording([&] {
    outcome = weft({"record", "cloth", "--run", "-o", file_, "--json"}, stop.get_token());
  });
  await_frame(file_, 1);
  stop.request_stop();
  recording.join();
  EXPECT_EQ(outcome.exit, 0) << outcome.err;
  const auto frames = recorded(file_);
  EXPECT_EQ(outcome.json()["frames"], frames.size());
  EXPECT_EQ(outcome.json()["complete"], false);
}

TEST_F(RecordingTest, SaysThatItWasStoppedBeforeItsEnd) {
  std::stop_source stop;
  Outcome outcome;
  std::thread recording([&] {
    outcome = weft({"record", "cloth", "--to", "9", "-o", file_}, stop.get_token());
  });
  await_frame(file_, 0);
  stop.request_stop();
  recording.join();
  EXPECT_EQ(outcome.exit, 130);
}

TEST_F(RecordingTest, OfASolverThatGaveUpHasEveryGoodFrame) {
  const v1::Session session = service_.create(diverging_scene(), "wild");
  const Outcome outcome = weft({"record", "wild", "--run", "-o", file_, "--json"});
  EXPECT_EQ(outcome.exit, 1);
  EXPECT_THAT(outcome.err, HasSubstr("SOLVER_FAILED"));
  const std::int64_t last = service_.get(session).frame();
  expect_equal(recorded(file_), stream("sessions/wild", 0, last));
}

struct NamedFault {
  const char* name;
  NetworkFault fault;
};

class BadNetwork : public RecordingTest, public ::testing::WithParamInterface<NamedFault> {};

TEST_P(BadNetwork, LosesAndDoublesNoFrame) {
  constexpr std::int64_t kFrames = 300;
  const BreakingProxy proxy(address_, GetParam().fault);
  Outcome outcome;
  std::thread recording([&] {
    outcome = run_weft({"record", "cloth", "--to", std::to_string(kFrames), "-o", file_, "--json",
                        "--server", proxy.address()});
  });
  await_frame(file_, 0);
  service_.run(session_, kFrames);
  recording.join();
  ASSERT_EQ(outcome.exit, 0) << outcome.err;
  EXPECT_EQ(proxy.broken(), GetParam().fault.breaks);
  EXPECT_GE(outcome.json()["reconnections"], GetParam().fault.breaks);
  expect_equal(recorded(file_), stream("sessions/cloth", 0, kFrames));
}

std::vector<NamedFault> network_faults() {
  using enum NetworkFault::End;
  using namespace std::chrono_literals;
  return {
      {"Resets", {.breaks = 3, .after_bytes = 25'000, .end = kReset}},
      {"Cuts", {.breaks = 3, .after_bytes = 25'000, .end = kCut}},
      {"Swallows", {.breaks = 3, .after_bytes = 25'000, .end = kSwallow}},
      {"PassesSingleBytes", {.breaks = 1, .after_bytes = 40'000, .slice = 1}},
      {"Delays", {.breaks = 1, .after_bytes = 40'000, .delay = 10ms}},
      {"Throttles", {.breaks = 1, .after_bytes = 40'000, .slice = 100, .delay = 100us}},
  };
}

INSTANTIATE_TEST_SUITE_P(, BadNetwork, ::testing::ValuesIn(network_faults()),
                         [](const auto& fault) { return std::string(fault.param.name); });

TEST_F(RecordingTest, GivesUpOnAServerThatIsGoneAndKeepsWhatItHas) {
  BreakingProxy proxy(address_);
  Outcome outcome;
  std::thread recording([&] {
    outcome = run_weft({"record", "cloth", "--to", "99", "--patience", "0", "-o", file_, "--server",
                        proxy.address()});
  });
  await_frame(file_, 0);
  service_.step(session_, 20);
  await_frame(file_, 20);
  proxy.close();
  recording.join();
  EXPECT_EQ(outcome.exit, 3);
  EXPECT_EQ(recorded(file_).size(), 21);
}

TEST_F(RecordingTest, EndsWhereTheServerLeftInOrderAndNoOtherCame) {
  Outcome outcome;
  std::thread recording([&] {
    outcome = weft({"record", "cloth", "--patience", "1", "-o", file_, "--json"});
  });
  await_frame(file_, 0);
  service_.server.stop();
  recording.join();
  EXPECT_EQ(outcome.exit, 1);
  EXPECT_THAT(outcome.err, HasSubstr("SERVER_DRAINING"));
  EXPECT_EQ(recorded(file_).size(), 1);
}

TEST_F(RecordingTest, IsReadableAfterItsRecorderWasKilled) {
  std::int64_t killed_after = 100;
  for (int round = 0; round < 3; ++round, killed_after += 700) {
    const std::string id = "killed-" + std::to_string(round);
    const std::string file = path(id + ".weft");
    const v1::Session session = service_.create(small_scene(), id);
    Process recorder("weft", {"record", id, "--to", "900000", "-o", file, "--server", address_},
                     path("recorder.txt"));
    await_frame(file, 0);
    service_.run(session, killed_after + 20'000);  // as many as its history keeps
    await_frame(file, killed_after);
    recorder.signal(SIGKILL);
    EXPECT_EQ(recorder.wait(), 128 + SIGKILL);
    service_.pause(session);

    const auto frames = recorded(file);
    ASSERT_GT(frames.size(), static_cast<std::size_t>(killed_after));
    EXPECT_EQ(ask({"info", file})["faults"], 0);
    expect_equal(frames, stream(session.name(), 0, static_cast<std::int64_t>(frames.size()) - 1));
  }
}

TEST_F(RecordingTest, IsEndedCleanlyByCtrlC) {
  Process recorder("weft", {"record", "cloth", "-o", file_, "--server", address_},
                   path("recorder.txt"));
  await_frame(file_, 0);
  service_.step(session_, 10);
  await_frame(file_, 10);
  recorder.signal(SIGINT);
  EXPECT_EQ(recorder.wait(), 0);
  EXPECT_EQ(recorded(file_).size(), 11);
  EXPECT_FALSE(std::filesystem::exists(file_ + "-journal"));
}

TEST_F(RecordingTest, StaysReadableWhenTheDiskIsFull) {
  service_.step(session_, 2000);
  Process recorder("weft",
                   {"record", "cloth", "--from", "0", "--to", "2000", "-o", file_, "--server",
                    address_, "--json"},
                   path("recorder.txt"), 200'000);
  EXPECT_EQ(recorder.wait(), 4);
  EXPECT_THAT(read_file(path("recorder.txt")),
              AllOf(HasSubstr("FILE_UNWRITABLE"), HasSubstr(file_)));
  EXPECT_EQ(weft({"info", file_}).exit, 0);
}

TEST_F(RecordingTest, NeverReplacesAFileUnasked) {
  write_file(file_, "precious");
  const Outcome refused = weft({"record", "cloth", "--to", "0", "-o", file_});
  EXPECT_EQ(refused.exit, 4);
  EXPECT_THAT(refused.err, AllOf(HasSubstr(file_), HasSubstr("exists")));
  EXPECT_EQ(weft({"record", "nosuch", "--to", "0", "-o", file_, "--force"}).exit, 1);
  EXPECT_EQ(read_file(file_), "precious") << "nothing came to replace it";
  EXPECT_EQ(weft({"record", "cloth", "--to", "0", "-o", file_, "--force"}).exit, 0);
  EXPECT_EQ(recorded(file_).size(), 1);
}

TEST_F(RecordingTest, NamesAPathThatCannotBeWritten) {
  const Outcome refused = weft({"record", "cloth", "--to", "0", "-o", path("no/such/dir.weft")});
  EXPECT_EQ(refused.exit, 4);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("no/such/dir.weft"), HasSubstr("No such file")));
}

// Reads a file of bytes as every command does: all that it holds, or nothing where it is refused.
std::optional<std::string> read_all(const std::string& file) try {
  RecordingReader reader(file);
  std::string all = reader.scene().SerializeAsString() + reader.header().SerializeAsString();
  for (auto number = reader.first_frame(); number <= reader.last_frame(); ++number)
    all += reader.read(number).SerializeAsString();
  return all;
} catch (const client::Problem& problem) {
  EXPECT_EQ(problem.exit, client::Exit::kFile) << problem.what();
  return std::nullopt;
}

TEST_F(RecordingTest, GivesWhatWasWrittenOrAnErrorWhateverByteIsChanged) {
  ask({"record", "cloth", "--run", "--to", "5", "-o", file_});
  const auto whole = read_all(file_);
  const std::string good = read_file(file_);
  std::fstream bytes(file_, std::ios::in | std::ios::out | std::ios::binary);
  const auto put = [&](std::size_t place, char byte) {
    bytes.seekp(static_cast<std::streamoff>(place)).put(byte).flush();
  };
  const std::string empty(16, '\0');
  int refused = 0;
  for (std::size_t place = 0; place < good.size(); ++place) {
    // of the room that nothing is in yet, one byte in 16 does
    if (place % 16 > 0 && good.compare(place - place % 16, 16, empty) == 0) continue;
    put(place, static_cast<char>(good[place] ^ (1 << (place % 8))));
    const auto found = read_all(file_);
    EXPECT_TRUE(!found || found == whole) << "byte " << place;
    if (!found) ++refused;
    put(place, good[place]);
  }
  EXPECT_GT(refused, 2500) << "of " << good.size();
  EXPECT_EQ(read_all(file_), whole);
}

TEST_F(RecordingTest, GivesWhatWasWrittenOrAnErrorWhereverItIsCut) {
  ask({"record", "cloth", "--run", "--to", "9", "-o", file_});
  const auto whole = read_all(file_);
  for (std::size_t size = read_file(file_).size(); size > 7; size -= 7) {
    std::filesystem::resize_file(file_, size);
    const auto found = read_all(file_);
    EXPECT_TRUE(!found || found == whole) << "cut to " << size;
  }
}

TEST_F(RecordingTest, SaysWhatToDoWithOneThatIsCutShort) {
  ask({"record", "cloth", "--run", "--to", "60", "-o", file_});
  std::filesystem::resize_file(file_, std::filesystem::file_size(file_) / 2);
  const Outcome info = weft({"info", file_});
  EXPECT_EQ(info.exit, 4);
  EXPECT_THAT(info.err, AllOf(HasSubstr("cut short"), HasSubstr("copy it again")));
}

TEST_F(RecordingTest, VerifySaysThatAllIsAsItWasWritten) {
  ask({"record", "cloth", "--run", "--to", "60", "-o", file_});
  const Outcome verified = weft({"verify", file_});
  EXPECT_EQ(verified.exit, 0);
  EXPECT_EQ(verified.out, file_ + ": 61 frames, 0 to 60, all as they were written\n");
  EXPECT_EQ(ask({"verify", file_})["frames"], 61);
}

// Pages that no frame is in are damaged too.
TEST_F(RecordingTest, VerifyReadsTheWholeFile) {
  ask({"record", "cloth", "--run", "--to", "60", "-o", file_});
  {
    client::Database database(file_, client::Database::Access::kCreate);
    database.execute(
        "PRAGMA writable_schema = 1; CREATE TABLE extra (x); "
        "DELETE FROM sqlite_schema WHERE name = 'extra'");
  }
  const Outcome verified = weft({"verify", file_, "--json"});
  EXPECT_EQ(verified.exit, 4);
  EXPECT_THAT(verified.err, HasSubstr("FILE_DAMAGED"));
}

TEST_F(RecordingTest, NamesAFrameThatIsMissing) {
  ask({"record", "cloth", "--run", "--to", "9", "-o", file_});
  client::Database(file_, client::Database::Access::kCreate)
      .execute("DELETE FROM frames WHERE number = 4 OR number = 9");
  const Outcome verified = weft({"verify", file_});
  EXPECT_EQ(verified.exit, 4);
  EXPECT_THAT(verified.err,
              AllOf(HasSubstr("2 faults"), HasSubstr("frame 4"), HasSubstr("frame 9")));
  EXPECT_EQ(weft({"export", file_, "-f", "csv", "-o", path("cloth.csv")}).exit, 4);
}

TEST_F(RecordingTest, NamesADamagedFrame) {
  ask({"record", "cloth", "--run", "--to", "60", "-o", file_});
  const std::string positions = RecordingReader(file_).read(31).positions_m();
  std::string bytes = read_file(file_);
  const std::size_t place = bytes.find(positions.substr(0, 64));
  ASSERT_NE(place, std::string::npos);
  bytes[place + 5] = static_cast<char>(bytes[place + 5] + 1);
  write_file(file_, bytes);

  const Outcome info = weft({"info", file_});
  EXPECT_EQ(info.exit, 4);
  EXPECT_THAT(info.err, HasSubstr("frame 31"));
  EXPECT_EQ(weft({"export", file_, "-f", "csv", "-o", path("cloth.csv")}).exit, 4);
}

}  // namespace
}  // namespace weft::testing

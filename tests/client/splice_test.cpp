#include <gmock/gmock.h>

#include <filesystem>

#include "client/recording/reader.h"
#include "client/recording/writer.h"
#include "tests/client/client_test.h"

namespace weft::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class SpliceTest : public ClientTest {
 protected:
  // Frames 0 to 20 of a session; the file.
  std::string record(const std::string& name) {
    const std::string file = path(name);
    const v1::Session session = service_.create();
    const std::string id = session.name().substr(session.name().find('/') + 1);
    ask({"record", id, "--run", "--to", "20", "-o", file});
    return file;
  }
  std::string cut(const std::string& file, const std::string& frames, const std::string& name) {
    ask({"cut", file, "--frames", frames, "-o", path(name)});
    return path(name);
  }
  std::string refusal(const std::vector<std::string>& arguments) {
    const Outcome outcome = weft(arguments);
    EXPECT_EQ(outcome.exit, 1);
    EXPECT_FALSE(std::filesystem::exists(path("out.weft")));
    EXPECT_FALSE(std::filesystem::exists(path("out.weft.part")));
    return outcome.err;
  }
};

TEST_F(SpliceTest, ACutHoldsItsFramesAsTheyAre) {
  const std::string file = record("whole.weft");
  const auto answer = ask({"cut", file, "--frames", "5:9", "-o", path("cut.weft")});
  EXPECT_EQ(answer["frames"], 5);
  client::RecordingReader whole(file), part(path("cut.weft"));
  EXPECT_EQ(part.first_frame(), 5);
  EXPECT_EQ(part.last_frame(), 9);
  EXPECT_EQ(part.scene().SerializeAsString(), whole.scene().SerializeAsString());
  for (std::int64_t frame = 5; frame <= 9; ++frame)
    EXPECT_EQ(part.read(frame).SerializeAsString(), whole.read(frame).SerializeAsString());
  EXPECT_EQ(ask({"verify", path("cut.weft")})["faults"], 0);
  EXPECT_EQ(ask({"cut", file, "--frames", "18:", "-o", path("end.weft")})["last_frame"], 20);
}

TEST_F(SpliceTest, PartsInAnyOrderThatOverlapMakeTheWhole) {
  const std::string file = record("whole.weft");
  const std::string a = cut(file, "0:8", "a.weft"), b = cut(file, "6:12", "b.weft"),
                    c = cut(file, "13:20", "c.weft");
  ask({"join", c, a, b, "-o", path("joined.weft")});
  EXPECT_EQ(ask({"diff", file, path("joined.weft"), "--within", "0"})["bit_equal"], true);
}

TEST_F(SpliceTest, WhatDoesNotBelongTogetherIsRefusedAndLeavesNoFile) {
  const std::string file = record("whole.weft");
  const std::string out = path("out.weft");
  const std::string a = cut(file, "0:8", "a.weft"), c = cut(file, "13:20", "c.weft");
  EXPECT_THAT(refusal({"join", a, c, "-o", out}), HasSubstr("no recording holds frames 9 to 12"));
  EXPECT_THAT(refusal({"join", a, record("other.weft"), "-o", out}),
              HasSubstr("are of different sessions"));
  EXPECT_THAT(refusal({"cut", file, "--frames", "21:30", "-o", out}),
              HasSubstr("there are frames 0 to 20 only"));

  client::RecordingReader reader(a);
  {
    client::RecordingWriter writer(path("forged.weft"), true, reader.scene(), reader.header());
    for (std::int64_t number = 0; number <= 8; ++number) {
      v1::Frame frame = reader.read(number);
      if (number == 4) frame.mutable_stats()->set_largest_strain(9);
      writer.add(frame);
    }
  }
  EXPECT_THAT(refusal({"join", a, path("forged.weft"), "-o", out}), HasSubstr("differ in frame 4"));
}

TEST_F(SpliceTest, ReplacesAFileOnlyWhenAsked) {
  const std::string file = record("whole.weft");
  const Outcome kept = weft({"cut", file, "--frames", "1:2", "-o", file});
  EXPECT_EQ(kept.exit, 4);
  EXPECT_THAT(kept.err, HasSubstr("the file exists"));
  ask({"cut", file, "--frames", "1:2", "-o", file, "--force"});
  EXPECT_EQ(client::RecordingReader(file).last_frame(), 2);
}

}  // namespace
}  // namespace weft::testing

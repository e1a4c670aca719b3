#include <gmock/gmock.h>

#include <cmath>
#include <cstring>

#include "client/recording/reader.h"
#include "client/recording/writer.h"
#include "tests/client/client_test.h"

namespace weft::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class DiffTest : public ClientTest {
 protected:
  // Frames 0 to `last` of a scene; the file.
  std::string record(const std::string& name, std::int64_t last,
                     const v1::Scene& scene = small_scene()) {
    const v1::Session session = service_.create(scene);
    const std::string id = session.name().substr(session.name().find('/') + 1);
    ask({"record", id, "--run", "--to", std::to_string(last), "--encoding", "float64", "-o",
         path(name)});
    return path(name);
  }

  // A copy in which one coordinate of one frame is another.
  std::string changed_copy(const std::string& file, std::int64_t frame_number, std::size_t number,
                           double change) {
    client::RecordingReader reader(file);
    const std::string copy = path("changed.weft");
    client::RecordingWriter writer(copy, true, reader.scene(), reader.header());
    for (auto n = reader.first_frame(); n <= reader.last_frame(); ++n) {
      v1::Frame frame = reader.read(n);
      if (n == frame_number) {
        char* place = frame.mutable_positions_m()->data() + number * sizeof(double);
        double value = 0;
        std::memcpy(&value, place, sizeof(value));
        value += change;
        std::memcpy(place, &value, sizeof(value));
      }
      writer.add(frame);
    }
    return copy;
  }
};

TEST_F(DiffTest, EqualRunsAreBitEqual) {
  const auto found = ask({"diff", record("a.weft", 30), record("b.weft", 30), "--within", "0"});
  EXPECT_EQ(found["bit_equal"], true);
  EXPECT_EQ(found["rms_m"], 0);
  EXPECT_EQ(found["largest"]["distance_m"], 0);
  EXPECT_EQ(found["last_frame"], 30);
  EXPECT_TRUE(found["first_unequal_frame"].is_null());
}

TEST_F(DiffTest, SaysHowFarAndWhere) {
  const std::string a = record("a.weft", 9);
  // z of particle 13 of 4 x 5, so row 2, column 3
  const std::string b = changed_copy(a, 6, 2 * 20 + 13, 0.25);
  const auto found = ask({"diff", a, b});
  EXPECT_NEAR(found["largest"]["distance_m"], 0.25, 1e-12);
  EXPECT_NEAR(found["rms_m"], 0.25 / std::sqrt(10 * 20), 1e-12);
  EXPECT_EQ(found["largest"]["frame"], 6);
  EXPECT_EQ(found["largest"]["row"], 2);
  EXPECT_EQ(found["largest"]["column"], 3);
  EXPECT_EQ(found["largest"]["sheet"], "sheet");
  EXPECT_EQ(found["bit_equal"], false);
  EXPECT_EQ(found["first_unequal_frame"], 6);
  EXPECT_THAT(weft({"diff", a, b}).out,
              AllOf(HasSubstr("0.25 m"), HasSubstr("frame 6"), HasSubstr("row 2, column 3"),
                    HasSubstr("no, frame 6 is the first")));
}

TEST_F(DiffTest, OneUlpIsNotBitEqual) {
  const std::string a = record("a.weft", 3);
  const std::string b = changed_copy(a, 3, 19, 1e-16);
  EXPECT_EQ(ask({"diff", a, b})["bit_equal"], false);
  EXPECT_EQ(weft({"diff", a, b, "--within", "0"}).exit, 1);
  EXPECT_EQ(weft({"diff", a, b, "--within", "1e-9"}).exit, 0);
}

TEST_F(DiffTest, APlaceThatIsNoNumberIsInfinitelyFar) {
  const std::string a = record("a.weft", 3);
  const std::string b = changed_copy(a, 2, 7, std::nan(""));
  const Outcome outcome = weft({"diff", a, b, "--within", "1e9"});
  EXPECT_EQ(outcome.exit, 1);
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("inf m"), HasSubstr("frame 2")));
  EXPECT_EQ(weft({"verify", b}).exit, 4);
}

TEST_F(DiffTest, ComparesTheFramesThatBothHave) {
  const std::string a = record("a.weft", 9);
  const std::string b = record("b.weft", 12);
  const Outcome outcome = weft({"diff", a, b});
  EXPECT_EQ(outcome.exit, 0);
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("10 (0 to 9)"), HasSubstr("b.weft (0 to 12)"),
                                 HasSubstr("where both have frames")));
  EXPECT_THAT(weft({"diff", a, b, "--within", "1"}).err, HasSubstr("the other lacks"));
  EXPECT_EQ(weft({"diff", a, b, "--within", "0", "--frames", "2:9"}).exit, 0);
}

TEST_F(DiffTest, WhatCannotBeComparedIsToldInOneSentence) {
  const std::string a = record("a.weft", 3);
  v1::Scene wider = small_scene();
  wider.mutable_sheets(0)->mutable_grid()->set_columns(6);
  const Outcome sheets = weft({"diff", a, record("wider.weft", 3, wider)});
  EXPECT_EQ(sheets.exit, 1);
  EXPECT_THAT(sheets.err, HasSubstr("sheet 1 is sheet (4 x 5 particles) and sheet (4 x 6 "
                                    "particles)\n"));
  v1::Scene slower = small_scene();
  slower.mutable_solver()->set_frame_step_s(0.1);
  EXPECT_THAT(weft({"diff", a, record("slower.weft", 3, slower)}).err, HasSubstr("0.1 s apart"));
  EXPECT_THAT(weft({"diff", a, a, "--frames", "8:"}).err, HasSubstr("frames 0 to 3"));
  EXPECT_EQ(weft({"diff", a, path("missing.weft")}).exit, 4);
}

}  // namespace
}  // namespace weft::testing

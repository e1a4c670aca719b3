#include <algorithm>
#include <sstream>

#include "tests/client/client_test.h"

namespace weft::testing {
namespace {

using ::testing::HasSubstr;

class LabCommandTest : public ClientTest {};

TEST_F(LabCommandTest, PrintsWhatWasAskedWhatWasFoundAndTheErrorWithin80Columns) {
  const Outcome outcome =
      weft({"lab", "cantilever", "--textile", "wool_tropical", "--spacing", "2.4"});
  EXPECT_EQ(outcome.exit, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("chord angle"));
  EXPECT_THAT(outcome.out, HasSubstr("note: at 2.4 mm"));
  std::istringstream lines(outcome.out);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80u) << line;
}

TEST_F(LabCommandTest, WritesTheBendingCurveOfThePapersFigure2) {
  const std::string csv = path("curve.csv"), svg = path("curve.svg");
  const auto answer = ask({"lab", "bending", "--textile", "wool_tropical", "--segments", "5",
                           "--spacing", "30", "--csv", csv, "--svg", svg});
  EXPECT_EQ(answer["curves"].size(), 1u);
  const std::string text = read_file(csv);
  EXPECT_TRUE(text.starts_with("curve,r,f_b N,f_b* N,approximation N,error N\n")) << text;
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 202);
  const std::string picture = read_file(svg);
  EXPECT_TRUE(picture.starts_with("<svg"));
  for (const char* name : {">f_b N<", ">f_b* N<", ">approximation N<", ">error N<"})
    EXPECT_THAT(picture, HasSubstr(name));
  EXPECT_EQ(picture.find("nan"), std::string::npos);
}

TEST_F(LabCommandTest, PutsMeshesOfTrianglesToEveryTest) {
  for (const char* mesh : {"right", "alternating", "equilateral", "irregular"}) {
    const auto answer =
        ask({"lab", "cantilever", "--textile", "wool_tropical", "--mesh", mesh, "--spacing", "4"});
    EXPECT_NEAR(answer["values"][0]["found"].get<double>(), 41.5, 0.5) << mesh;
  }
  for (const char* test : {"tensile", "shear", "bending", "chain", "drape"}) {
    const auto answer =
        ask({"lab", test, "--textile", "wool_tropical", "--mesh", "irregular", "--spacing", "20"});
    EXPECT_GT(answer["values"][0]["found"].get<double>(), 0) << test;
  }
}

TEST_F(LabCommandTest, TakesATextileFromAFile) {
  const std::string file = path("mine.json");
  write_file(file, R"({"measured": {"areal_density_kg_per_m2": 0.2, "shear_n_per_m": 40}})");
  const auto answer = ask({"lab", "shear", "--isometric", "--textile", file});
  EXPECT_EQ(answer["values"][0]["asked"], 40);
  EXPECT_NEAR(answer["values"][0]["found"].get<double>(), 40, 1);
}

TEST_F(LabCommandTest, SaysWhatCannotBeTested) {
  const Outcome outcome =
      weft({"lab", "cantilever", "--textile", "wool_tropical", "--spacing", "200"});
  EXPECT_EQ(outcome.exit, 1);
  EXPECT_THAT(outcome.err, HasSubstr("spacings_m[0]: 0.2 m is not within"));
}

}  // namespace
}  // namespace weft::testing

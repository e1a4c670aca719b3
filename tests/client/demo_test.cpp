#include <gmock/gmock.h>

#include <filesystem>

#include "tests/client/client_test.h"
#include "tests/client/page_content.h"

namespace weft::testing {
namespace {

using ::testing::HasSubstr;

using DemoTest = ClientTest;

TEST_F(DemoTest, EndsWithTheExperimentsTheSpeedOfEachLawAndOnePageOfAll) {
  const auto result = ask({"demo", "--longest", "0.2", "-o", path("demo")});
  EXPECT_EQ(result["runs"].size(), 12U);
  EXPECT_EQ(result["runs"][11]["verdict"], "not good") << "after 0.2 s";
  const auto& speed = result["speed"];
  ASSERT_EQ(speed.size(), 5U);
  EXPECT_EQ(speed[0]["bending"], "series");
  EXPECT_EQ(speed[0]["times_series"], 1);
  EXPECT_EQ(speed[1]["bending"], "exact");
  EXPECT_EQ(speed[1]["rms_from_exact_m"], 0);
  for (std::size_t law = 2; law < speed.size(); ++law) {
    EXPECT_GT(speed[law]["times_series"], 0);
    EXPECT_GT(speed[law]["rms_from_exact_m"], 0);
  }
  const std::string page = description(read_file(result["page"].get<std::string>())).dump();
  EXPECT_THAT(page, HasSubstr(R"("title":"Speed")"));
  EXPECT_THAT(page, HasSubstr(R"({"group":"Measured","rows":[["time",)"));
  EXPECT_THAT(page, HasSubstr(R"(["against series","1.00 x"])"));
  EXPECT_THAT(page, HasSubstr(R"("title":"Dressed")"));
  EXPECT_TRUE(std::filesystem::exists(path("demo/paper-4-exact.pc2")));
}

}  // namespace
}  // namespace weft::testing

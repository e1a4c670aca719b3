#include <sstream>

#include "tests/client/client_test.h"

// What the READMEs show, and what depends on how frames are computed.
namespace weft::testing {
namespace {

using ::testing::HasSubstr;

TEST(Readme, ShowsWhatItsCommandsAnswer) {
  const std::string root = WEFT_TEST_DATA_DIR "/../../";
  const std::string readme = read_file(root + "README.md") + read_file(root + "client/README.md");
  const TemporaryDirectory directory;
  const std::string scene = directory.path("scene.json"), file = directory.path("again.weft");
  const auto answer = [](const std::vector<std::string>& arguments) {
    const Outcome outcome = run_weft(arguments);
    EXPECT_EQ(outcome.exit, 0) << outcome.err;
    return outcome.out;
  };
  answer({"scene", "new", "--template", "sphere", "--textile", "wool_tropical", "-o", scene});
  const std::string recorded = answer({"record", scene, "--until-rest", "-o", file});
  EXPECT_THAT(readme, HasSubstr(recorded.substr(recorded.find(": "))));
  const std::string hang = directory.path("hang.json");
  answer({"scene", "new", "-t", "hang", "--textile", "denim_11oz", "-o", hang});
  EXPECT_THAT(readme,
              HasSubstr("    " + answer({"run", hang, "--embedded", "--until-rest", "--relax"})));

  // what it says of the scene and of the recording, but for names, times and sizes
  std::istringstream lines(answer({"scene", "check", scene}) + answer({"info", file}));
  for (std::string line; std::getline(lines, line);) {
    const bool differs = line.starts_with("recorded") || line.starts_with("session") ||
                         line.starts_with("uid") || line.find("scene.json: ") != line.npos ||
                         line.find("again.weft") != line.npos;
    if (!differs) {
      EXPECT_THAT(readme, HasSubstr("    " + line + '\n'));
    }
  }
}

}  // namespace
}  // namespace weft::testing

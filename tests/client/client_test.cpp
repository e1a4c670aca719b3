#include "tests/client/client_test.h"

#include <fstream>
#include <sstream>

#include "client/scene_file.h"
#include "client/weft.h"

namespace weft::testing {

Outcome run_weft(std::vector<std::string> arguments, const std::stop_token& stop) {
  std::ostringstream out;
  std::ostringstream err;
  const int exit = client::run_weft(std::move(arguments), {.out = out, .err = err}, stop);
  return {exit, out.str(), err.str()};
}

std::string read_file(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

void write_file(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

Outcome ClientTest::weft(std::vector<std::string> arguments, const std::stop_token& stop) {
  arguments.insert(arguments.end(), {"--server", address_});
  return run_weft(std::move(arguments), stop);
}

nlohmann::json ClientTest::ask(std::vector<std::string> arguments) {
  arguments.emplace_back("--json");
  const Outcome outcome = weft(std::move(arguments));
  EXPECT_EQ(outcome.exit, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  return outcome.json();
}

std::string ClientTest::scene_file(const v1::Scene& scene, const std::string& name) const {
  write_file(path(name), client::scene_text(scene));
  return path(name);
}

std::vector<v1::Frame> ClientTest::stream(const std::string& session, std::int64_t first,
                                          std::int64_t last, v1::FrameEncoding encoding) {
  v1::StreamFramesRequest request;
  request.set_session(session);
  request.set_start_frame(first);
  request.set_end_frame(last);
  request.mutable_format()->set_stats(true);
  request.mutable_format()->set_encoding(encoding);
  return Stream(service_, request).rest();
}

}  // namespace weft::testing

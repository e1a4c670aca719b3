#pragma once

#include <gmock/gmock.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "tests/support/service/service.h"
#include "tests/support/temporary_directory.h"

namespace weft::testing {

// What a command wrote, and the exit code.
struct Outcome {
  int exit = 0;
  std::string out;
  std::string err;

  nlohmann::json json() const { return nlohmann::json::parse(out); }
};

// Runs `weft` within this process.
Outcome run_weft(std::vector<std::string> arguments, const std::stop_token& stop = {});

std::string read_file(const std::filesystem::path& path);
void write_file(const std::filesystem::path& path, const std::string& text);

// A server that listens on a port of its own, and a directory for files.
class ClientTest : public ::testing::Test {
 protected:
  // A command against the server.
  Outcome weft(std::vector<std::string> arguments, const std::stop_token& stop = {});
  // One that must succeed; what it answers to --json.
  nlohmann::json ask(std::vector<std::string> arguments);

  std::string path(const std::string& name) const { return directory_.path(name); }
  std::string scene_file(const v1::Scene& scene, const std::string& name = "scene.json") const;
  // Frames first to last as the server streams them to a recorder.
  std::vector<v1::Frame> stream(const std::string& session, std::int64_t first, std::int64_t last,
                                v1::FrameEncoding encoding = v1::FRAME_ENCODING_FLOAT32);

  Service service_{ServerOptions{}};
  const std::string address_ = service_.server.address();

 private:
  TemporaryDirectory directory_;
};

}  // namespace weft::testing

#pragma once

#include <gmock/gmock.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/service/service.h"
#include "tests/support/temporary_directory.h"

namespace weft::testing {

inline std::string content(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

// A directory with sessions in it, and servers that take them over from each other.
class Restart : public ::testing::Test {
 protected:
  Restart() { start(); }

  void start() {
    ServerOptions options = Service::in_process();
    options.data_dir = directory_.name();
    options.snapshot_ms = snapshot_ms_;
    options.limits.history_bytes_per_session = history_bytes_;
    options.idle = idle_;
    service_ = std::make_unique<Service>(options);
  }
  void restart() {
    service_.reset();
    start();
  }

  // All frames up to the one given, which there may have to be waited for.
  std::vector<v1::Frame> frames(const v1::Session& session, std::int64_t last) {
    return Stream(*service_, frames_of(session, 0, last)).rest();
  }
  static void expect_equal(const std::vector<v1::Frame>& found,
                           const std::vector<v1::Frame>& wanted) {
    ASSERT_EQ(found.size(), wanted.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      ASSERT_EQ(found[i].SerializeAsString(), wanted[i].SerializeAsString()) << "frame " << i;
    }
  }

  void set_preset(const v1::Session& session, const std::string& preset) {
    v1::UpdateTextileRequest request;
    request.set_name(session.name());
    request.mutable_textile()->set_preset(preset);
    ASSERT_EQ(service_->error(&Service::Sessions::UpdateTextile, request).code,
              grpc::StatusCode::OK);
  }

  std::string file() const { return directory_.path("sessions.db"); }

  // Frames that this server has computed, restored ones among them.
  std::int64_t computed() {
    grpc::ClientContext context;
    v1::ServerStats stats;
    EXPECT_TRUE(service_->servers->GetServerStats(&context, {}, &stats).ok());
    return stats.frames();
  }
  void wait_until_held() {
    for (std::int64_t before = -1, now; (now = computed()) != before; before = now)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  const TemporaryDirectory directory_;
  int snapshot_ms_ = 2000;
  std::chrono::milliseconds idle_{0};
  std::int64_t history_bytes_ = 64 << 20;
  std::unique_ptr<Service> service_;
};

// A server that keeps a snapshot of every frame, as far as it comes to it.
class RestartWithSnapshots : public Restart {
 protected:
  RestartWithSnapshots() {
    snapshot_ms_ = 0;
    restart();
  }

  std::filesystem::path snapshots_of(const v1::Session& session) const {
    return std::filesystem::path(directory_.path("snapshots")) / session.uid();
  }
  // In the order in which they were taken.
  std::vector<std::filesystem::path> files_of(const v1::Session& session) const {
    std::vector<std::filesystem::path> files;
    for (const auto& file : std::filesystem::directory_iterator(snapshots_of(session)))
      if (std::isdigit(file.path().filename().string().front()) != 0) files.push_back(file.path());
    std::sort(files.begin(), files.end(),
              [](const auto& a, const auto& b) { return frame_of(a) < frame_of(b); });
    return files;
  }
  static std::int64_t frame_of(const std::filesystem::path& file) {
    return std::stoll(file.filename().string());
  }
  std::int64_t last_of(const v1::Session& session) const {
    if (!std::filesystem::exists(snapshots_of(session))) return -1;
    const auto files = files_of(session);
    return files.empty() ? -1 : frame_of(files.back());
  }
  // Steps until there is a snapshot of the newest frame. One is left out while the one before it is
  // written.
  std::int64_t kept(const v1::Session& session) {
    for (;;) {
      const std::int64_t before = last_of(session);
      const std::int64_t frame = service_->step(session).frame();
      const auto part = snapshots_of(session) / ".part";
      for (int look = 0; last_of(session) == before; ++look) {
        if (look > 50 && !std::filesystem::exists(part)) break;  // it was left out
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      if (last_of(session) == frame) return frame;
    }
  }
};

}  // namespace weft::testing

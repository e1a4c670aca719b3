#pragma once

#include <chrono>
#include <string>

#include "client/assets.h"
#include "client/recording/database.h"
#include "client/sheet_layout.h"
#include "weft/v1/frame.pb.h"
#include "weft/v1/scene.pb.h"

namespace weft::client {

// Writes a recording. What is committed stays readable, whatever becomes of this process.
class RecordingWriter {
 public:
  // Throws where the file exists, unless it is to be replaced. Where there are sheets of triangles
  // their topology is kept, and the assets; else neither.
  RecordingWriter(const std::string& path, bool replace, const v1::Scene& scene,
                  const v1::StreamHeader& header, const Topology& topology = {},
                  const Assets& assets = {});
  // Commits what it can.
  ~RecordingWriter();
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;

  // Commits twice a second.
  void add(const v1::Frame& frame);
  void commit();

 private:
  using Clock = std::chrono::steady_clock;

  std::string uid_;
  std::int64_t last_frame_;
  Database database_;
  Statement insert_;
  Statement extend_;
  bool pending_ = false;
  std::size_t pending_bytes_ = 0;
  Clock::time_point last_commit_;
};

// Adds to a recording that is written how its last frame was judged.
void add_verdict(const std::string& path, const v1::Verdict& verdict);

}  // namespace weft::client

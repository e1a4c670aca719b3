#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/assets.h"
#include "client/recording/database.h"
#include "client/sheet_layout.h"
#include "weft/v1/frame.pb.h"
#include "weft/v1/scene.pb.h"
#include "weft/v1/session.pb.h"

namespace weft::client {

// Reads a recording, a frame at a time. A recorder may still be writing it: the reader sees the
// frames that were there when it was made.
class RecordingReader {
 public:
  explicit RecordingReader(const std::string& path);

  const std::string& path() const { return path_; }
  const v1::Scene& scene() const { return scene_; }
  const v1::StreamHeader& header() const { return header_; }
  // Sound; see meshes_of().
  const Topology& topology() const { return topology_; }
  const std::string& recorded_at() const { return recorded_at_; }

  // It holds every frame from first_frame() to last_frame(); one less where there is none.
  std::int64_t first_frame() const { return header_.start_frame(); }
  std::int64_t last_frame() const { return last_frame_; }
  // Those that the file really has.
  std::int64_t count_frames();

  // The frame, as it was written, its arrays as long as the header says; else a Problem.
  v1::Frame read(std::int64_t number);
  // The two frames around a time, (number, time); one at either end.
  std::vector<std::pair<std::int64_t, double>> find_around(double time_s);
  // Those that the scene names, as far as the file has them.
  Assets assets();
  // Of the last frame, where the session was judged.
  std::optional<v1::Verdict> verdict();
  // What is wrong with the file itself, if anything.
  std::vector<std::string> find_damage();

 private:
  void read_topology(std::int64_t version);

  std::string path_;
  Database database_;
  v1::Scene scene_;
  v1::StreamHeader header_;
  Topology topology_;
  std::string recorded_at_;
  std::int64_t last_frame_ = 0;
};

}  // namespace weft::client

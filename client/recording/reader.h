#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/recording/database.h"
#include "weft/v1/frame.pb.h"
#include "weft/v1/scene.pb.h"

namespace weft::client {

// Reads a recording, a frame at a time; a recorder may still be writing it.
class RecordingReader {
 public:
  explicit RecordingReader(const std::string& path);

  const std::string& path() const { return path_; }
  const v1::Scene& scene() const { return scene_; }
  const v1::StreamHeader& header() const { return header_; }
  const std::string& recorded_at() const { return recorded_at_; }

  // Number of the first frame not below this one.
  std::optional<std::int64_t> find_from(std::int64_t number);
  // The frame, checked; a frame that is damaged or not there is a Problem.
  v1::Frame read(std::int64_t number);
  // The two frames around a time, (number, time); one at either end.
  std::vector<std::pair<std::int64_t, double>> find_around(double time_s);
  // What is wrong with the file itself, if anything.
  std::vector<std::string> find_damage();

 private:
  std::string path_;
  Database database_;
  v1::Scene scene_;
  v1::StreamHeader header_;
  std::string recorded_at_;
};

}  // namespace weft::client
